from glob import glob
from pathlib import Path
import xml.etree.ElementTree as ElementTree

from setuptools import find_packages, setup

package_name = 'flex_planner'
DATA_FOLDERS = {'flex_planner.config': 'config',
                'flex_planner.recording.flex_planner_interfaces': 'flex_planner_interfaces'}
# the one place that says who maintains it, and where it is
PACKAGE_XML = ElementTree.parse(Path(__file__).with_name('package.xml'))
MAINTAINER = PACKAGE_XML.find('maintainer')

setup(
    name=package_name,
    version='0.2.0',
    description='Trajectory planning for flexible-link manipulators',
    long_description=Path(__file__).with_name('README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    maintainer=MAINTAINER.text,
    maintainer_email=MAINTAINER.get('email'),
    url=PACKAGE_XML.findtext('url[@type="repository"]'),
    license='Apache-2.0',
    python_requires='>=3.10',
    classifiers=[
        'Development Status :: 4 - Beta', 'Intended Audience :: Science/Research',
        'License :: OSI Approved :: Apache Software License', 'Operating System :: POSIX',
        'Programming Language :: Python :: 3', 'Topic :: Scientific/Engineering',
        'Typing :: Typed'],
    # what is read without ROS lies inside the package, too: not every installation has a share
    packages=[*find_packages(include=['flex_planner', 'flex_planner.*']), *DATA_FOLDERS],
    package_dir=DATA_FOLDERS,
    package_data={'flex_planner': ['py.typed'],
                  'flex_planner.collocation': ['core.c', 'core_parts/*.c'],
                  'flex_planner.control': ['held_periods.c'],
                  'flex_planner.dynamics': ['integration.c'],
                  'flex_planner.config': ['arm_template.yaml', 'arms/*.yaml', 'studies/*.yaml'],
                  'flex_planner.recording.flex_planner_interfaces': [
                      'msg/*.msg', 'srv/*.srv', 'action/*.action'],
                  'flex_planner.reports.recording': [
                      'arm.js', 'page.html', 'player.js', 'plots.js', 'space.js']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*.yaml')),
        (f'share/{package_name}/config/arms', glob('config/arms/*.yaml')),
        (f'share/{package_name}/config/studies', glob('config/studies/*.yaml')),
        (f'share/{package_name}/launch', glob('launch/*.py')),
        (f'share/{package_name}/rviz', glob('rviz/*.rviz')),
    ],
    install_requires=[
        'casadi>=3.6.7',
        'matplotlib>=3.6',
        'mcap>=1.1',
        'numpy>=1.26',
        'pyyaml>=6.0',
        'rosbags>=0.11',
        'scipy>=1.11',
        'zstandard>=0.22',
    ],
    # for flex-planner map
    extras_require={'maps': ['dask>=2024.1', 'distributed>=2024.1', 'numcodecs>=0.12',
                             'xarray>=2024.10', 'zarr>=2.18,!=3.0.*'],
                    # for progress bars
                    'notebooks': ['tqdm>=4.60'],
                    # for URDF files that end in .xacro
                    'xacro': ['xacro>=2.0'],
                    'test': ['autograd', 'hypothesis', 'mcap-ros2-support', 'mpmath', 'pytest',
                             'pytest-timeout']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'planner = flex_planner.ros.runtime.start:planner',
            'arm_simulator = flex_planner.ros.runtime.start:arm_simulator',
            'replay = flex_planner.ros.runtime.start:replay',
            'flex-planner = flex_planner.cli:main',
        ],
    },
)
