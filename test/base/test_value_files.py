"""Values in one file: what goes in comes out, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import json
from pathlib import Path

from flex_planner.base.errors import ValueFileError
from flex_planner.base.value_files import load_value, save_value
import numpy as np
import pytest


class Colour(Enum):
    RED = 'red'


@dataclass(frozen=True)
class Leaf:
    colour: Colour
    weights: np.ndarray


@dataclass(frozen=True)
class Branch:
    leaves: tuple[Leaf, ...]
    length: float
    name: str | None


class Tree:
    def __init__(self, branch: Branch) -> None:
        self.branch, self.same, self.count = branch, branch, np.float64(2.5)


CLASSES = (Colour, Leaf, Branch, Tree)


@pytest.fixture
def tree() -> Tree:
    leaf = Leaf(Colour.RED, np.array([1.0, np.inf, np.nan]))
    return Tree(Branch((leaf, leaf), np.inf, None))


def test_value_comes_back_with_what_it_shares(tree: Tree, tmp_path: Path) -> None:
    save_value(tmp_path / 'tree', tree)
    found = load_value(tmp_path / 'tree', CLASSES)
    assert isinstance(found, Tree)
    assert found.same is found.branch
    assert found.branch.leaves[0] is found.branch.leaves[1]
    assert (found.branch.length, found.branch.name, found.count) == (np.inf, None, 2.5)
    leaf = found.branch.leaves[0]
    assert leaf.colour is Colour.RED
    np.testing.assert_array_equal(leaf.weights, [1.0, np.inf, np.nan])


def test_class_that_the_reader_does_not_name_is_not_made(tree: Tree, tmp_path: Path) -> None:
    save_value(tmp_path / 'tree', tree)
    with pytest.raises(ValueFileError, match='is damaged or no file of saved values'):
        load_value(tmp_path / 'tree', (Colour, Leaf, Branch))


@pytest.mark.parametrize('content', [b'', b'PK\x03\x04', b'{}', b'\x93NUMPY\x01\x00'])
def test_file_of_something_else_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / 'file').write_bytes(content)
    with pytest.raises(ValueFileError, match='is damaged or no file of saved values'):
        load_value(tmp_path / 'file', CLASSES)


def test_cut_file_is_refused(tree: Tree, tmp_path: Path) -> None:
    save_value(tmp_path / 'tree', tree)
    whole = (tmp_path / 'tree').read_bytes()
    for size in range(0, len(whole), 97):
        (tmp_path / 'cut').write_bytes(whole[:size])
        with pytest.raises(ValueFileError):
            load_value(tmp_path / 'cut', CLASSES)


def test_file_of_a_later_format_is_refused_saying_so(tmp_path: Path) -> None:
    with (tmp_path / 'later').open('wb') as file:
        header = json.dumps({'format': 3, 'objects': [], 'root': None})
        np.savez(file, **{'values.json': np.array(header)})
    with pytest.raises(ValueFileError, match='has format 3, but must have 2'):
        load_value(tmp_path / 'later', CLASSES)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match='nowhere'):
        load_value(tmp_path / 'nowhere', CLASSES)


def test_failed_write_leaves_the_old_file_alone(tree: Tree, tmp_path: Path) -> None:
    save_value(tmp_path / 'tree', tree)
    with pytest.raises(TypeError):
        save_value(tmp_path / 'tree', Branch((), 1.0, {1: object()}))  # type: ignore[arg-type]
    assert isinstance(load_value(tmp_path / 'tree', CLASSES), Tree)
    assert [path.name for path in tmp_path.iterdir()] == ['tree']


def test_array_of_objects_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match='only numbers can'):
        save_value(tmp_path / 'leaf', Leaf(Colour.RED, np.array([object()])))
    assert list(tmp_path.iterdir()) == []
