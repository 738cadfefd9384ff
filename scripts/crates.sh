# Shell functions that build the packages of the workspace as `cargo publish` would upload them.

# Builds the packages in a folder and unpacks them there. The unpacked packages depend on each other by path, because no
# registry has them yet.
package_crates() {
    folder=$1
    mkdir -p "$folder/.cargo"
    # `wgray-wasm-test` is not published.
    cargo package --quiet --workspace --exclude wgray-wasm-test --no-verify --allow-dirty --target-dir "$folder/cargo"
    mv "$folder"/cargo/package/*.crate "$folder"
    rm -rf "$folder/cargo"
    echo '[patch.crates-io]' >"$folder/.cargo/config.toml"
    for crate in "$folder"/*.crate; do
        tar -xzf "$crate" -C "$folder"
        name=$(basename "$crate" .crate) # such as wgray-image-0.1.0
        case $name in
            wgray-[a-z]*) echo "${name%-*} = { path = \"$name\" }" >>"$folder/.cargo/config.toml" ;;
        esac
    done
    (cd "$folder"/wgray-[0-9]*/ && cargo metadata --quiet --format-version 1 >/dev/null) # also updates Cargo.lock
}
