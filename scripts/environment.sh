# shellcheck shell=bash
# To be sourced: paths of the prepared environment, and a function to enter it.
#
# POSE_HOME        what `prepare.sh` builds (default: .pose in the checkout)
# POSE_ROS_SETUP   the setup file of an installed ROS (default: /opt/ros/jazzy/setup.bash)
# POSE_PYTHON      the interpreter to build on (default: the first python3 that fits)

POSE_ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)"
POSE_HOME="${POSE_HOME:-$POSE_ROOT/.pose}"
POSE_ROS_SETUP="${POSE_ROS_SETUP:-/opt/ros/jazzy/setup.bash}"
POSE_VENV="$POSE_HOME/venv"

# A system service may have no HOME, without which ROS finds no folder for its logs.
[ -n "${HOME:-}" ] || { unset HOME; HOME=~; export HOME; }

# Body data stay on this machine unless the user configures another network.
export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
export RMW_IMPLEMENTATION="${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}"
if [ -z "${FASTRTPS_DEFAULT_PROFILES_FILE:-}" ]; then
    FASTRTPS_DEFAULT_PROFILES_FILE="$POSE_ROOT/scripts/fastdds.xml"
    # LOCALHOST alone still answers other hosts that know this one's address.
    if [ "$ROS_AUTOMATIC_DISCOVERY_RANGE" = LOCALHOST ] &&
        [ -z "${ROS_STATIC_PEERS:-}${ROS_DISCOVERY_SERVER:-}" ]; then
        FASTRTPS_DEFAULT_PROFILES_FILE="$POSE_ROOT/scripts/fastdds_loopback.xml"
    fi
fi
export FASTRTPS_DEFAULT_PROFILES_FILE
# numpy's thread pool only slows matrices of this size down, and takes the cores from the nodes.
export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"

has_installed_ros() { [ -f "$POSE_ROS_SETUP" ]; }

# source_setup FILE: colcon's and ROS's setup files read unset variables.
source_setup() {
    set +u
    # shellcheck disable=SC1090
    source "$1"
    set -u
}

enter_ros() {
    if has_installed_ros; then
        source_setup "$POSE_ROS_SETUP"
        source_setup "$POSE_VENV/bin/activate"
        return
    fi
    source_setup "$POSE_VENV/bin/activate"
    # Remove the variables of another ROS environment.
    unset PYTHONPATH
    export AMENT_PREFIX_PATH="$POSE_VENV"
    export CMAKE_PREFIX_PATH="$POSE_VENV"
    # The wheels would otherwise find this path themselves and start Python a second time.
    local library_path
    library_path="$(cat "$POSE_HOME/library_path")"
    export LD_LIBRARY_PATH="$library_path${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
}

enter_workspace() {
    enter_ros
    if [ -f "$POSE_HOME/underlay/install/local_setup.bash" ]; then
        source_setup "$POSE_HOME/underlay/install/local_setup.bash"
    fi
    source_setup "$POSE_HOME/install/local_setup.bash"
}
