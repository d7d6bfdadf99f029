"""The source of the compiled core, which is in parts."""

from pathlib import Path

from flex_planner.collocation import core


def test_the_source_of_the_core_contains_every_part_once():
    folder = Path(core.__file__).with_name('core_parts')
    parts = [part.read_text() for part in folder.iterdir()]
    source = core.read_source()
    assert len(parts) >= 5
    assert [source.count(part) for part in parts] == [1] * len(parts)
    assert '#include "' not in source
