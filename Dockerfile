# wgray with software Vulkan, for machines and clusters that run containers.
#
#     docker build -t wgray .
#     docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" wgray render scene.toml -o picture.png
#
# Files are read and written below /work. `--gpus all -e NVIDIA_DRIVER_CAPABILITIES=graphics` gives the container access to
# NVIDIA GPUs, `--device /dev/dri` to AMD and Intel GPUs. Without a GPU, wgray renders the same bits on the CPU.

FROM docker.io/library/rust:1-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo install --locked --path . --root /installed

FROM docker.io/library/debian:bookworm-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /installed/bin/wgray /usr/local/bin/wgray
# Without `-u`, the program runs as `nobody`, who can only write to mounted folders with suitable permissions.
USER 65534:65534
WORKDIR /work
ENTRYPOINT ["wgray"]
CMD ["--help"]
