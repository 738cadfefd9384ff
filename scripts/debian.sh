# Shell functions that install Debian packages and find Vulkan drivers, sourced by other scripts.

# Installs Debian packages, as root or with sudo. Without apt, prints the first argument and exits.
install() {
    if ! command -v apt-get >/dev/null; then
        echo "$0: $1" >&2
        exit 1
    fi
    shift
    sudo=
    if [ "$(id -u)" != 0 ]; then
        sudo=sudo
    fi
    echo "$0: installing with ${sudo:+$sudo }apt-get: $*" >&2
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get update -q
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@"
}

# Succeeds if the Vulkan loader is installed.
vulkan_loader_found() {
    { ldconfig -p 2>/dev/null || /sbin/ldconfig -p; } | grep -q 'libvulkan\.so\.1'
}

# Sets WGRAY_CHROMIUM, unless it is set, to the path of Chromium; installs Chromium if it is missing.
find_chromium() {
    if [ -z "${WGRAY_CHROMIUM:-}" ]; then
        WGRAY_CHROMIUM=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
    fi
    if [ -z "$WGRAY_CHROMIUM" ]; then
        install "Chromium is missing; install it, or set WGRAY_CHROMIUM to its path" chromium
        WGRAY_CHROMIUM=$(command -v chromium)
    fi
}

# Prints the path of the driver manifest of the SwiftShader that Chromium includes.
swiftshader() {
    for folder in "$(dirname "$(readlink -f "$WGRAY_CHROMIUM")")" /usr/lib/chromium /usr/lib/chromium-browser; do
        if [ -e "$folder/libvk_swiftshader.so" ] && [ -e "$folder/vk_swiftshader_icd.json" ]; then
            echo "$folder/vk_swiftshader_icd.json"
            return
        fi
    done
    echo "$0: no SwiftShader (libvk_swiftshader.so, vk_swiftshader_icd.json) beside $WGRAY_CHROMIUM" >&2
    exit 1
}
