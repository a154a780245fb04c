# The robot's software, and the simulator, on a standard ROS 2 Jazzy.
#   docker build -t w2b . && docker run --rm -it w2b ros2 launch w2b_sim walk.launch.py
# Not run yet by the maintainers (no Docker engine at hand), only linted: tell us what fails.
FROM ros:jazzy-ros-base

SHELL ["/bin/bash", "-o", "pipefail", "-c"]
# Versions of Debian packages follow the base image.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-venv python3-dev g++ make git \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /w2b
COPY requirements requirements
# PyBullet has no wheel for this Python: it is built here, which takes some minutes.
RUN python3 -m venv --system-site-packages .venv \
    && .venv/bin/pip install --no-cache-dir colcon-common-extensions \
        -r requirements/controller.txt -r requirements/sim.txt -r requirements/mujoco.txt \
        -c requirements/constraints.txt
COPY ros2_ws/src ros2_ws/src
WORKDIR /w2b/ros2_ws
RUN source /opt/ros/jazzy/setup.bash && source ../.venv/bin/activate && python -m colcon build
WORKDIR /w2b
RUN printf '%s\n' '#!/bin/bash' 'set -e' 'source /opt/ros/jazzy/setup.bash' \
        'source /w2b/.venv/bin/activate' 'source /w2b/ros2_ws/install/setup.bash' 'exec "$@"' \
        > /entrypoint.sh && chmod +x /entrypoint.sh
ENTRYPOINT ["/entrypoint.sh"]
# ROS nodes end in order on SIGINT: servos off, files closed.
STOPSIGNAL SIGINT
CMD ["ros2", "launch", "w2b_sim", "walk.launch.py"]
