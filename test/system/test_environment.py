"""tools/setup_environment.py and tools/run."""

import importlib.util
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / 'tools' / 'setup_environment.py'


@pytest.fixture
def setup_environment():
    spec = importlib.util.spec_from_file_location('setup_environment', SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def complaint(module, check, *arguments):
    with pytest.raises(module.SetupError) as caught:
        check(*arguments)
    sentence = str(caught.value)
    assert sentence.endswith('.') and '\n' not in sentence
    return sentence


@pytest.fixture
def checkout(tmp_path):
    """Return a folder with nothing but the script and no requirements."""
    (tmp_path / 'tools').mkdir()
    (tmp_path / 'requirements').mkdir()
    shutil.copy(SCRIPT, tmp_path / 'tools')
    return tmp_path


def run_setup(checkout, *options, **variables):
    return subprocess.run(
        [sys.executable, 'tools/setup_environment.py', *options], cwd=checkout, text=True,
        capture_output=True, env={**os.environ, **variables}, timeout=120,
    )


@pytest.mark.parametrize('version', [(3, 9, 18), (3, 14, 0), (2, 7, 18)])
def test_python_without_wheels_is_refused_with_both_bounds(setup_environment, version):
    sentence = complaint(setup_environment, setup_environment.check_python, version, 'CPython')
    assert '{}.{}.{}'.format(*version) in sentence
    assert '3.10 to 3.13' in sentence


def test_another_implementation_of_python_is_refused(setup_environment):
    check = setup_environment.check_python
    assert 'PyPy 3.10.14' in complaint(setup_environment, check, (3, 10, 14), 'PyPy')


@pytest.mark.parametrize('version', [(3, 10, 0), (3, 11, 7), (3, 12, 1), (3, 13, 9)])
def test_python_with_wheels_is_accepted(setup_environment, version):
    setup_environment.check_python(version, 'CPython')


@pytest.mark.parametrize(('system', 'machine'), [('Darwin', 'arm64'), ('Linux', 'aarch64')])
def test_other_machines_are_pointed_to_a_ros_installation(setup_environment, system, machine):
    check = setup_environment.check_platform
    sentence = complaint(setup_environment, check, system, machine)
    assert f'{system} {machine}' in sentence
    assert 'colcon' in sentence


@pytest.mark.parametrize('missing', ['venv', 'ensurepip'])
def test_missing_venv_module_is_named_with_its_package(setup_environment, missing):
    sentence = complaint(
        setup_environment, setup_environment.check_modules,
        lambda name: None if name == missing else object(),
    )
    assert repr(missing) in sentence
    assert 'python3-venv' in sentence


def test_missing_python_headers_are_named_with_their_package(setup_environment, tmp_path):
    check = setup_environment.check_headers
    sentence = complaint(setup_environment, check, tmp_path)
    assert str(tmp_path) in sentence
    assert 'python3-dev' in sentence


@pytest.mark.parametrize(('present', 'variables', 'missing'), [
    ({'c++', 'cmake', 'make'}, {}, 'no C compiler'),
    ({'gcc', 'cmake', 'make'}, {}, 'no C++ compiler'),
    ({'cc', 'c++', 'make'}, {}, 'no cmake'),
    ({'cc', 'c++', 'cmake'}, {}, 'no make'),
    ({'cc', 'c++', 'cmake', 'make'}, {'CXX': 'icpx -O2'}, 'looked for icpx'),
])
def test_missing_build_tool_is_named(setup_environment, present, variables, missing):
    sentence = complaint(
        setup_environment, setup_environment.check_tools,
        lambda name: name if name in present else None, variables,
    )
    assert missing in sentence


def test_other_environments_do_not_leak_into_the_set_up(setup_environment):
    foreign = {
        'PYTHONPATH': '/opt/ros/jazzy/lib', 'AMENT_PREFIX_PATH': '/opt/ros/jazzy',
        'VIRTUAL_ENV': '/else', 'LD_LIBRARY_PATH': '/opt/ros/jazzy/lib', 'PIP_USER': '1',
        '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1', 'MAKEFLAGS': 'n',
    }
    own = {'HOME': '/home/someone', 'PIP_CONFIG_FILE': '/etc/pip.conf', 'CC': 'clang'}
    clean = setup_environment.clean_environment({**foreign, **own, 'PATH': '/usr/bin'})
    venv = str(setup_environment.VENV)
    assert own.items() <= clean.items()
    assert clean['PATH'] == f'{venv}/bin:/usr/bin'
    assert clean['AMENT_PREFIX_PATH'] == clean['CMAKE_PREFIX_PATH'] == venv
    assert not (foreign.keys() - {'AMENT_PREFIX_PATH'}) & clean.keys()


def test_cmake_files_of_the_wheels_get_this_machines_folders(setup_environment, tmp_path):
    path = tmp_path / 'share' / 'std_msgs' / 'cmake' / 'export.cmake'
    path.parent.mkdir(parents=True)
    built = '/opt/python/cp312-cp312'
    path.write_text(f'"{built}/include/python3.12;'
                    f'{built}/lib/python3.12/site-packages/numpy/_core/include;${{_IMPORT}}"')
    for _ in range(2):
        setup_environment.relocate_cmake_files(tmp_path, '/inc', '/site')
        assert path.read_text() == '"/inc;/site/numpy/_core/include;${_IMPORT}"'


def test_digest_sees_names_and_contents_but_no_caches(setup_environment, tmp_path, monkeypatch):
    monkeypatch.setattr(setup_environment, 'ROOT', tmp_path)
    (tmp_path / 'a.msg').write_text('float64 x')
    digests = [setup_environment.digest([tmp_path])]
    (tmp_path / '__pycache__').mkdir()
    (tmp_path / '__pycache__' / 'a.pyc').write_text('')
    assert setup_environment.digest([tmp_path]) == digests[0]
    (tmp_path / 'a.msg').write_text('float64 y')
    digests.append(setup_environment.digest([tmp_path]))
    (tmp_path / 'a.msg').rename(tmp_path / 'b.msg')
    digests.append(setup_environment.digest([tmp_path]))
    assert len(set(digests)) == 3


@pytest.mark.parametrize('content', [None, '', '{"interp', '[]'])
def test_unfinished_stamp_counts_as_none(setup_environment, tmp_path, content):
    if content is not None:
        (tmp_path / 'stamp').write_text(content)
    assert setup_environment.read_stamp(tmp_path / 'stamp') == {}


def test_set_up_without_compiler_ends_before_it_creates_anything(checkout):
    done = run_setup(checkout, PATH='')
    assert done.returncode == 1
    assert done.stdout == ''
    assert done.stderr.startswith('setup: There is no C compiler')
    assert not (checkout / '.venv').exists()


def test_failing_pip_is_reported_and_an_unfinished_venv_replaced(checkout):
    (checkout / '.venv').mkdir()
    (checkout / '.venv' / 'leftover').write_text('of an interrupted run')
    (checkout / 'requirements' / 'broken.txt').write_text('./no_such_file.whl\n')
    done = run_setup(checkout)
    assert done.returncode == 1
    assert 'pip could not install' in done.stderr
    assert 'no_such_file.whl' in done.stderr
    assert 'Traceback' not in done.stderr
    assert not (checkout / '.venv' / 'leftover').exists()


def test_library_needs_no_compiler_and_has_a_venv_of_its_own(checkout):
    (checkout / 'requirements' / 'runtime.txt').write_text('# nothing\n')
    (checkout / 'requirements' / 'ros.txt').write_text('./no_such_file.whl\n')
    done = run_setup(checkout, '--library', PATH='')
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.startswith('setup: creating .venv-library with Python 3.')
    assert (checkout / '.venv-library' / 'bin' / 'pip').exists()
    assert not (checkout / '.venv').exists()
    assert run_setup(checkout, '--library').stdout == ''  # it is up to date


def test_progress_of_pip_says_what_and_how_far(setup_environment, tmp_path, capsys):
    progress = setup_environment.PipProgress('installing', tmp_path, 9)
    for line in ('Collecting numpy==2.2.6 (from -r runtime.txt (line 7))',
                 'Downloading numpy-2.2.6.whl (16.8 MB)', 'Collecting scipy',
                 'Downloading scipy.whl.metadata (61 kB)', 'Requirement already satisfied: six'):
        progress.hear(line)
    assert progress.state() == '2 of about 9 packages found, 17 MB downloaded, scipy'
    progress.hear('Installing collected packages: a, b, c')
    for name in 'ab':
        (tmp_path / 'lib' / 'python3.11' / 'site-packages' / f'{name}.dist-info').mkdir(
            parents=True)
    assert progress.state() == '2 of 3 packages installed'
    progress.shown -= progress.SELDOM
    progress.show()
    progress.show()  # not again so soon
    assert capsys.readouterr().out.splitlines() == [
        'setup: installing', 'setup:   2 of 3 packages installed, 0 s']


def test_progress_of_a_build_is_that_of_its_makefiles(setup_environment):
    progress = setup_environment.BuildProgress('building')
    assert progress.state() == ''
    for line in ('[  7%] Building C object a.c.o', 'gcc: note', '[100%] Built target a'):
        progress.hear(line)
    assert progress.state() == '100%'


def test_output_of_a_command_comes_whole_and_its_end_with_a_failure(setup_environment):
    progress, code = setup_environment.Progress('running'), 'print("é" * 100_000); print("end")'
    command = [sys.executable, '-X', 'utf8', '-c']
    assert setup_environment.run([*command, code], 'Failed.', progress) == (
        'é' * 100_000 + '\nend\n')
    with pytest.raises(setup_environment.SetupError, match=r'Failed[.] The end .*\n    why$'):
        setup_environment.run([*command, 'print("why"); exit(3)'], 'Failed.', progress)


@pytest.mark.skipif(not (ROOT / '.venv').exists(), reason='needs the environment of make setup')
class TestRun:
    def run(self, *command, **variables):
        return subprocess.run(
            [ROOT / 'tools' / 'run', *command], capture_output=True, text=True, timeout=60,
            env={'PATH': os.environ['PATH'], **variables},
        )

    def test_without_a_command_tells_the_usage(self):
        done = self.run()
        assert done.returncode == 2
        assert 'usage' in done.stderr

    def test_help_tells_the_usage(self):
        done = self.run('--help')
        assert (done.returncode, done.stderr) == (0, '')
        assert done.stdout.startswith('usage: tools/run COMMAND')
        assert self.run('--nonsense').returncode == 2

    @pytest.mark.skipif(shutil.which('ros2') is not None, reason='ROS 2 is installed')
    def test_missing_ros2_command_is_told_with_the_way_to_join(self):
        done = self.run('ros2', 'topic', 'list', ROS_DOMAIN_ID='7')
        assert done.returncode == 127
        assert 'ROS_DOMAIN_ID=7' in done.stderr

    def test_foreign_environment_is_replaced(self):
        done = self.run('env', PYTHONPATH='/foreign', LD_LIBRARY_PATH='/foreign',
                        AMENT_PREFIX_PATH='/foreign', RMW_IMPLEMENTATION='foreign')
        assert 'foreign' not in done.stdout

    def test_domain_is_private_unless_the_caller_names_one(self):
        chosen = self.run('printenv', 'ROS_DOMAIN_ID').stdout
        assert 1 <= int(chosen) <= 101
        assert self.run('printenv', 'ROS_DOMAIN_ID', ROS_DOMAIN_ID='7').stdout == '7\n'

    def test_exit_code_is_that_of_the_command(self):
        assert self.run('bash', '-c', 'exit 7').returncode == 7

    def test_sources_come_before_the_installed_copy(self):
        done = self.run('python', '-c', 'import flex_planner; print(flex_planner.__file__)')
        assert Path(done.stdout.strip()) == ROOT / 'flex_planner' / '__init__.py'
