"""Install the package, which needs no ROS, as an ament_python package."""

from xml.etree import ElementTree

from setuptools import find_packages, setup

package_name = 'w2b_core'

setup(
    name=package_name,
    version=ElementTree.parse('package.xml').findtext('version'),
    packages=find_packages(exclude=['test']),
    package_data={package_name: ['py.typed', 'bodies/*.yaml', 'controllers/*.json',
                                 'vocabularies/*', 'vocabularies/*/*', 'vocabularies/*/*/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml', 'LICENSE']),
    ],
    install_requires=['setuptools', 'numpy', 'PyYAML'],
    # defusedxml: bodies from a maker's URDF.  rich: the progress of `vocabulary install`.
    extras_require={'test': ['pytest'], 'urdf': ['defusedxml'], 'progress': ['rich']},
    zip_safe=False,
    maintainer='the w2b maintainers',
    maintainer_email='w2b@users.noreply.github.com',
    description='Hearing, network, senses, bodies and controller files: a word moves a body.',
    license='Apache-2.0',
)
