"""Parameters that are paths: the home folder is found, and what is no path is refused at once."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.paths import PathError
from flex_planner.ros.settings.planner import PlannerSettings
import pytest


@pytest.mark.parametrize(('folder', 'ros_home', 'expected'), [
    ('~/recordings', None, 'recordings'), ('', None, '.ros/flex_planner'),
    ('', '~/ros', 'ros/flex_planner'), ('', 'relative', '.ros/flex_planner')])
def test_recordings_go_to_the_home_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                          folder: str, ros_home: str | None,
                                          expected: str) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.delenv('ROS_HOME', raising=False)
    if ros_home is not None:
        monkeypatch.setenv('ROS_HOME', ros_home)
    assert PlannerSettings(recording_folder=folder).output_folder() == tmp_path / expected


def test_folder_of_a_user_who_does_not_exist_is_refused_when_it_is_set() -> None:
    with pytest.raises(PathError, match="'~no-such-user/a' is no path"):
        PlannerSettings(recording_folder='~no-such-user/a')
