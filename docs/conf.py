"""Settings of Sphinx; `make docs` builds the site, and so does rosdoc2."""

from __future__ import annotations

from pathlib import Path
import sys

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from docutils.nodes import document  # noqa: E402
from flex_planner.base.version import VERSION  # noqa: E402
from site_pages.source_links import (  # noqa: E402
    link_sources,
    maintainer,
    repository_address,
    repository_root,
    title_links,
)
from site_pages.write import write_pages  # noqa: E402
from sphinx.application import Sphinx  # noqa: E402
from sphinx.config import Config  # noqa: E402
from sphinx.ext import autosummary  # noqa: E402

project = 'flex_planner'
ROOT = repository_root(HERE)
author = maintainer(ROOT)
copyright = author  # noqa: A001 - Sphinx's name for it
version = release = VERSION

extensions = ['myst_parser', 'numpydoc', 'site_pages.mathml', 'sphinx.ext.autodoc',
              'sphinx.ext.autosummary']
# the last five are what rosdoc2 adds to its copy, whose index would take the place of ours
exclude_patterns = ['_build', 'site_pages', 'index.rst', 'modules.rst', 'flex_planner*.rst',
                    'standard*', '__readme_include.rst']
myst_enable_extensions = ['attrs_inline', 'colon_fence', 'deflist', 'dollarmath']
myst_heading_anchors = 4
nitpicky = False  # types in docstrings are words

html_theme = 'furo'
html_title = f'flex_planner {VERSION}'
html_static_path = ['static']
html_css_files = ['site.css']
html_show_sphinx = html_show_copyright = False
html_math_renderer = 'mathml'

templates_path = ['templates']
autosummary_ignore_module_all = False
# after which a sentence goes on
autosummary.WELL_KNOWN_ABBREVIATIONS += ('eq.', 'eqs.', 'fig.', 'D.C.')  # type: ignore[assignment]
autodoc_member_order = 'bysource'
autodoc_preserve_defaults = True
autodoc_typehints = 'none'  # the docstrings have them, in words
numpydoc_show_class_members = False

ADDRESS = repository_address(ROOT)


def read_source(app: Sphinx, page: str, content: list[str]) -> None:
    """Let links to files of the repository lead there, and show the titles of pages."""
    content[0] = title_links(link_sources(content[0], page, ADDRESS))


def leave_out_of_navigation(app: Sphinx, tree: document) -> None:
    """
    Take the pages of functions and classes out of the tree beside every page.

    Their names stand on the page of their part of the library. In the tree there would be
    hundreds, and to draw it on hundreds of pages would take most of the time of a build.

    """
    for node in [*tree.findall(autosummary.autosummary_toc)]:
        node.parent.remove(node)


def write_generated(app: Sphinx, config: Config) -> None:
    """Write the pages that are made from the sources, before Sphinx looks for pages."""
    write_pages(HERE / 'generated', ROOT)


def setup(app: Sphinx) -> None:
    """Connect what is done before and while pages are read."""
    app.connect('config-inited', write_generated)
    app.connect('source-read', read_source)
    app.connect('doctree-read', leave_out_of_navigation, priority=1)
