"""Install the brain as an ament_python package."""

from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package_name = 'w2b_controller'

setup(
    name=package_name,
    version=ElementTree.parse('package.xml').findtext('version'),
    packages=find_packages(exclude=['test']),
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml', 'LICENSE']),
        ('bin', ['bin/w2b']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
    ],
    install_requires=['setuptools', 'numpy', 'PyYAML', 'rich'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    maintainer='the w2b maintainers',
    maintainer_email='w2b@users.noreply.github.com',
    description='The brain: a word moves a body.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'brain = w2b_controller.brain:main',
            'console = w2b_controller.console:main',
            'say = w2b_controller.say:main',
            'vocabulary = w2b_core.vocabulary.command:main',
            'w2b = w2b_controller.cli.main:main',
        ],
    },
)
