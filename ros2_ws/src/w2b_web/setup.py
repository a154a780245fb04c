"""Install the page as an ament_python package."""

from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package_name = 'w2b_web'

setup(
    name=package_name,
    version=ElementTree.parse('package.xml').findtext('version'),
    packages=find_packages(exclude=['test']),
    package_data={package_name: ['py.typed', 'html/*', 'static/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml', 'LICENSE']),
        (f'share/{package_name}/config', glob('config/*')),
    ],
    install_requires=['setuptools', 'aiohttp'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    maintainer='the w2b maintainers',
    maintainer_email='w2b@users.noreply.github.com',
    description='The page: see the robot in a browser, say words to it, stop it.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'listen = w2b_web.voice.listen:main',
            'page = w2b_web.page:main',
            'play = w2b_web.play:main',
        ],
    },
)
