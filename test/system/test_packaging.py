"""Package descriptions, entry points and installed files agree with one another."""

import ast
from dataclasses import replace
from importlib import metadata
from pathlib import Path
import re
import sys
import xml.etree.ElementTree as ElementTree

from ament_index_python.packages import get_package_share_directory
from catkin_pkg.package import parse_package
import flex_planner
from flex_planner.arms.arm_files import load_arm
from flex_planner.ros.settings.fields import as_mapping
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner.ros.settings.simulator import SimulatorSettings
from packaging.requirements import Requirement
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [ROOT, ROOT / 'flex_planner_interfaces']
LAUNCH_FILES = sorted(ROOT.glob('launch/*.launch.py'))


def setup_keyword(name):
    """Return a literal keyword argument of the call of ``setup``."""
    for node in ast.walk(ast.parse((ROOT / 'setup.py').read_text())):
        if isinstance(node, ast.keyword) and node.arg == name:
            return ast.literal_eval(node.value)
    raise LookupError(name)


def console_scripts():
    return dict(re.split(r'\s*=\s*', line)
                for line in setup_keyword('entry_points')['console_scripts'])


def imported_modules():
    """Return the top-level modules that the package and its launch files import."""
    modules = set()
    for path in [*ROOT.glob('flex_planner/**/*.py'), *LAUNCH_FILES]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                modules |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                modules.add(node.module)
    return {module.partition('.')[0] for module in modules}


@pytest.mark.parametrize('folder', PACKAGES, ids=lambda folder: folder.name)
def test_package_xml_is_valid(folder):
    warnings = []
    package = parse_package(str(folder / 'package.xml'), warnings=warnings)
    package.validate(warnings=warnings)
    assert not warnings


def test_versions_agree():
    versions = {ElementTree.parse(folder / 'package.xml').findtext('version')
                for folder in PACKAGES}
    versions |= {flex_planner.__version__, setup_keyword('version'),
                 metadata.version('flex_planner')}
    assert len(versions) == 1


def test_maintainer_and_address_are_those_of_package_xml():
    ours, interfaces = (ElementTree.parse(folder / 'package.xml') for folder in PACKAGES)
    maintainer, address = ours.find('maintainer'), ours.findtext('url[@type="repository"]')
    metadata_ = metadata.metadata('flex_planner')
    assert metadata_['Maintainer'] == maintainer.text
    assert metadata_['Maintainer-email'] == maintainer.get('email')
    assert ElementTree.tostring(interfaces.find('maintainer')) == ElementTree.tostring(maintainer)
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert citation['authors'] == [{'name': maintainer.text}]
    assert citation.get('repository-code') == address
    assert citation['version'] == flex_planner.__version__


def test_pinned_versions_satisfy_setup():
    lines = (ROOT / 'requirements' / 'runtime.txt').read_text().splitlines()
    pinned = dict(line.split('==') for line in lines if not line.startswith('#'))
    wanted = {r.name: r.specifier for r in map(Requirement, setup_keyword('install_requires'))}
    assert pinned.keys() == wanted.keys()
    assert [name for name in pinned if pinned[name] not in wanted[name]] == []


def test_what_is_imported_is_declared():
    ros = {depend.name for depend in parse_package(str(ROOT / 'package.xml')).exec_depends}
    extras = setup_keyword('extras_require')
    lines = [*setup_keyword('install_requires'), *extras['maps'], *extras['notebooks'],
             *extras['xacro']]
    pip = {Requirement(line).name for line in lines}
    # rosdep's names of what comes from pip; it has none for mcap, which another brings along
    ros = {name.removesuffix('-pip') for name in ros} - {'mcap-ros2-support'}
    imported = imported_modules() - sys.stdlib_module_names - {'flex_planner'}
    declared = {'yaml' if name == 'pyyaml' else name for name in ros | pip}
    assert imported - declared == set()
    assert {name for name in declared - imported if not name.startswith('python3-')} == set()


def test_interfaces_are_all_built():
    folder = ROOT / 'flex_planner_interfaces'
    names = {str(path.relative_to(folder)) for kind in ('msg', 'srv', 'action')
             for path in folder.glob(f'{kind}/*.{kind}')}
    listed = re.findall(r'\b(?:msg|srv|action)/\w+\.\w+', (folder / 'CMakeLists.txt').read_text())
    assert set(listed) == names


@pytest.mark.parametrize('name', console_scripts())
def test_entry_point_can_be_called(name):
    (entry_point,) = metadata.entry_points(group='console_scripts', name=name)
    assert entry_point.value == console_scripts()[name]
    assert callable(entry_point.load())


def test_parameter_and_launch_files_are_installed():
    share = Path(get_package_share_directory('flex_planner'))
    for pattern in ('config/*.yaml', 'config/arms/*.yaml', 'launch/*.py', 'rviz/*.rviz'):
        wanted = {path.name: path.read_text() for path in ROOT.glob(pattern)}
        installed = {path.name: path.read_text() for path in share.glob(pattern)}
        assert installed == wanted
        assert wanted


@pytest.mark.parametrize(('node', 'settings'), [
    ('flex_planner', PlannerSettings), ('arm_simulator', SimulatorSettings)])
def test_parameter_file_lists_every_parameter_with_its_default(node, settings):
    text = (ROOT / 'config' / 'planner.yaml').read_text()
    neutral = yaml.safe_load(text)[f'/**/{node}']['ros__parameters']
    everything = re.sub(r'^    # (\w+: \[|base_frame: )', r'    \1', text, flags=re.MULTILINE)
    written = yaml.safe_load(everything)[f'/**/{node}']['ros__parameters']
    defaults = as_mapping(settings.for_arm(load_arm(written.pop('arm'))))
    assert written == defaults
    assert {name: type(value) for name, value in written.items()} == {
        name: type(value) for name, value in defaults.items()}
    # what has an entry per joint, and a name of the arm, is left out and follows any arm
    lists = {name for name, value in defaults.items() if isinstance(value, list)}
    assert neutral.keys() - {'arm'} == defaults.keys() - lists - {'base_frame'}


@pytest.mark.parametrize(('node', 'settings'), [
    ('flex_planner', PlannerSettings), ('arm_simulator', SimulatorSettings)])
def test_parameters_of_the_paper_are_accepted(node, settings):
    text = (ROOT / 'config' / 'paper.yaml').read_text()
    written = yaml.safe_load(text)[f'/**/{node}']['ros__parameters']
    replace(settings.for_arm(load_arm(written.pop('arm'))), **written)
