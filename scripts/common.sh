# Sourced by the scripts beside it: where things are, which Debian packages are needed, and how they get here.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

build_packages=(g++ cmake ninja-build ccache libeigen3-dev libtet1.5-dev libcgal-dev libsuitesparse-dev
  libopenblas-dev nlohmann-json3-dev libcli11-dev libspdlog-dev libssl-dev libcairo2-dev
  fonts-dejavu-core libjs-three)
test_packages=(libpng-dev libgtest-dev python3 chromium chromium-driver)

die() {
  echo "$(basename "$0"): error: $*" >&2
  exit 1
}

trap 'die "line $LINENO: $BASH_COMMAND"' ERR

# Installs what is missing of the given packages, as root or through sudo; silent about what is already there.
install_packages() {
  local missing=() package sudo=()
  for package in "$@"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "these packages are missing and there is no sudo: ${missing[*]}"
    sudo=(sudo)
  fi
  echo "installing: ${missing[*]}"
  "${sudo[@]}" apt-get update -qq || die "apt-get update failed"
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null ||
    die "apt-get could not install: ${missing[*]}"
}

# configure_and_build FOLDER [cmake options]
configure_and_build() {
  local folder=$1
  shift
  cmake -S "$root" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@" >"$folder.log" 2>&1 || {
    tail -n 20 "$folder.log" >&2
    die "cmake failed, see $folder.log"
  }
  cmake --build "$folder" || die "the build failed"
}

# reference_config NAME FOLDER: prints the config of a reference model in FOLDER, in the pose of the paper.
reference_config() {
  local rotate translate count
  case $1 in
    dome) rotate="[0, 0, 0]" translate="[0, 0, 3]" count=80 ;;
    bridge) rotate="[180, 0, 0]" translate="[0, 0, 100]" count=150 ;;
    topopt) rotate="[0, 140, 0]" translate="[0, 0, 20]" count=100 ;;
    *) die "no reference model is called $1" ;;
  esac
  echo "{\"model\": {\"up_axis\": \"y\", \"rotate_deg\": $rotate, \"translate_mm\": $translate}, \"layers\": {\"count\": $count},
    \"field\": {\"source\": \"scalar_file\", \"path\": \"$2/$1/field.txt\"}, \"machine\": {\"extends\": \"ur5e_duet.json\"}}"
}
