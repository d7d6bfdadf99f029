"""Formulas as MathML, which browsers show without scripts and without the network."""

from __future__ import annotations

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)
# what MathML does by itself: brackets grow, operators stand off
_NEEDLESS = re.compile(r'\\[bB]igg?[lrm]?(?![a-zA-Z])|\\mathrel(?=\{)')


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer, and say that pages may be made side by side."""
    app.add_html_math_renderer('mathml', (_visit_inline, None), (_visit_block, None))
    return {'parallel_read_safe': True, 'parallel_write_safe': True}


def _visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula of a line."""
    translator.body.append(_mathml(node, as_block=False))
    raise nodes.SkipNode


def _visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula that stands alone."""
    translator.body.append('<div class="math">')
    translator.body.append(_mathml(node, as_block=True))
    translator.body.append('</div>')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, *, as_block: bool) -> str:
    """Return the formula of a node; an error names it."""
    try:
        text = str(tex2mathml(_NEEDLESS.sub('', node.astext()), as_block=as_block))
        return text.replace(' accent="true"', '')  # with it, many fonts put dots into letters
    except MathError as error:
        logger.warning('%s: %s', error, node.astext(), location=node)
        return ''
