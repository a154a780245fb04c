"""Install the hardware side as an ament_python package."""

from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

package_name = 'w2b_hw'

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
    ],
    install_requires=['setuptools', 'numpy', 'PyYAML', 'smbus2', 'imufusion',
                      'adafruit-circuitpython-pca9685'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    maintainer='the w2b maintainers',
    maintainer_email='w2b@users.noreply.github.com',
    description='The robot: servos and IMU over I2C, calibration and safety.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'hardware = w2b_hw.node:main',
            'relax = w2b_hw.relax:main',
            'calibrate = w2b_hw.entry:calibrate',
            'preflight = w2b_hw.entry:preflight',
            'emulator = w2b_hw.entry:emulator',
        ],
    },
)
