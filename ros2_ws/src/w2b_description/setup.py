"""Install the robot description, its frames and the viewers' files as an ament_python package."""

from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package_name = 'w2b_description'

setup(
    name=package_name,
    version=ElementTree.parse('package.xml').findtext('version'),
    packages=find_packages(exclude=['test']),
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml', 'LICENSE']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
        (f'share/{package_name}/rviz', glob('rviz/*')),
        (f'share/{package_name}/foxglove', glob('foxglove/*')),
    ],
    install_requires=['setuptools', 'numpy'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    maintainer='the w2b maintainers',
    maintainer_email='w2b@users.noreply.github.com',
    description='Robot description, frames (tf), RViz and Foxglove.',
    license='Apache-2.0',
    entry_points={'console_scripts': ['description = w2b_description.description:main']},
)
