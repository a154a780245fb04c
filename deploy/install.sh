#!/usr/bin/env bash
# Install w2b on a Raspberry Pi with Ubuntu 24.04 (arm64) and ROS 2 Jazzy from apt.
#
#   deploy/install.sh              packages, virtual environment, workspace, systemd units
#   deploy/install.sh --units DIR  only write the units, filled in, to DIR
#
# Run it as the user that shall run the robot; it asks for sudo where it has to. Safe to repeat.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
user=$(id -un)

units() {
    for unit in "$root"/deploy/systemd/*.service; do
        sed -e "s|@ROOT@|$root|g" -e "s|@USER@|$user|g" "$unit" >"$1/$(basename "$unit")"
    done
}

if [ "${1:-}" = --units ]; then
    units "$2"
    exit
fi
if [ ! -f /opt/ros/jazzy/setup.bash ]; then
    echo "install: no /opt/ros/jazzy: install ros-jazzy-ros-base first (docs.ros.org, Ubuntu deb packages)" >&2
    exit 1
fi

# numpy, scipy and YAML from apt: ROS is built against that numpy. The compiler is for Blinka's sysv_ipc.
sudo apt-get update -q
sudo apt-get install -y -q python3-venv python3-numpy python3-scipy python3-yaml python3-rich \
    python3-defusedxml python3-colcon-common-extensions python3-dev build-essential i2c-tools
sudo usermod -aG i2c "$user"

config=/boot/firmware/config.txt
if [ -f "$config" ] && ! grep -q '^dtparam=i2c_arm_baudrate=400000' "$config"; then
    printf '%s\n' 'dtparam=i2c_arm=on' 'dtparam=i2c_arm_baudrate=400000' |
        sudo tee -a "$config" >/dev/null
    echo "install: I2C at 400 kHz is on after the next reboot"
fi
echo i2c-dev | sudo tee /etc/modules-load.d/w2b-i2c.conf >/dev/null

[ -x "$root/.venv/bin/python" ] || python3 -m venv --system-site-packages "$root/.venv"
touch "$root/.venv/COLCON_IGNORE"
"$root/.venv/bin/pip" install -q \
    -r "$root/requirements/controller.txt" -r "$root/requirements/hw.txt" \
    -r "$root/requirements/web.txt"

set +u
. /opt/ros/jazzy/setup.bash
set -u
# The venv's Python runs colcon, so that it becomes the interpreter of the installed scripts.
(cd "$root/ros2_ws" && "$root/.venv/bin/python" -m colcon build \
    --packages-select w2b_core w2b_ros w2b_controller w2b_hw w2b_web)

filled=$(mktemp -d)
units "$filled"
sudo install -m 644 "$filled"/*.service /etc/systemd/system/
rm -r "$filled"
sudo systemctl daemon-reload
"$root/deploy/run" preflight || true
cat <<END
install: next
  1. reboot, if I2C was just turned on
  2. deploy/run preflight                     until it says: ready
  3. deploy/run calibrate                     with the legs off the ground
  4. sudo systemctl enable --now w2b-hardware w2b-brain
END
