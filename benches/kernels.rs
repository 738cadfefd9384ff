//! Benchmarks of single twin functions, and of full images on the first adapter and on the CPU.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec3};
use wgray::scene::{Overrides, Scene};
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::gpu::{self, AdapterChoice, Gpu, Options, compose::Shaders};
use wgray_render::job::{self, WorkSplit};
use wgray_render::pack::pack;
use wgray_trace::cpu::ellipsoid::intersect_ellipsoid;
use wgray_trace::cpu::light::segments_to_light;
use wgray_trace::cpu::phong::{Lobes, phong_block};
use wgray_trace::cpu::ray::Ray;
use wgray_trace::cpu::rectangle::intersect_rectangle;
use wgray_trace::cpu::shadow::{SampleBlock, light_frustum, may_block, occlusion_mask};
use wgray_trace::cpu::surface::surface_at;
use wgray_trace::cpu::triangle::intersect_triangle;
use wgray_trace::records::{ELLIPSOID, GRID, INFINITE_T, Packed, RECTANGLE, TRIANGLE};

fn scene(path: &str, size: u32) -> Packed {
    let overrides = Overrides {
        size: Some((size, size)),
        light_samples: Some(16),
        ..Overrides::default()
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    pack(&Scene::load_with(&path, &overrides).expect("the project's scenes are valid"))
}

/// Measures the peak throughput of one core in operations: multiplications and additions of eight f32 per instruction,
/// without memory accesses.
#[cfg(target_arch = "x86_64")]
fn peak(criterion: &mut Criterion) {
    use std::arch::x86_64::{__m256, _mm256_add_ps, _mm256_mul_ps, _mm256_set1_ps};

    const ROUNDS: u64 = 10_000;
    const CHAINS: usize = 12;

    #[target_feature(enable = "avx2")]
    fn chains(factor: __m256) -> [__m256; CHAINS] {
        let mut values = [_mm256_set1_ps(1.0); CHAINS];
        for _ in 0..ROUNDS {
            for value in &mut values {
                *value = _mm256_add_ps(_mm256_mul_ps(*value, factor), factor);
            }
        }
        values
    }

    if !std::arch::is_x86_feature_detected!("avx2") {
        return;
    }
    let mut group = criterion.benchmark_group("peak");
    group.throughput(Throughput::Elements(ROUNDS * CHAINS as u64 * 8 * 2));
    group.bench_function("multiply and add", |b| {
        // SAFETY: the processor has AVX2.
        b.iter(|| unsafe { chains(black_box(_mm256_set1_ps(0.5))) })
    });
    group.finish();
}

#[cfg(not(target_arch = "x86_64"))]
fn peak(_: &mut Criterion) {}

/// Measures the functions that dominate the render time.
fn twins(criterion: &mut Criterion) {
    let scene = scene("scenes/cornell.toml", 400);
    let index_of_kind = |kind| {
        scene
            .primitives
            .iter()
            .position(|primitive| primitive.kind == kind)
            .expect("scenes/cornell.toml has all of these kinds")
    };
    let [rectangle, triangle, ellipsoid] =
        [RECTANGLE, TRIANGLE, ELLIPSOID].map(|kind| &scene.primitives[index_of_kind(kind)]);
    let ray = Ray {
        origin: Vec3::new(0.0, -3.0, 1.3),
        direction: Vec3::new(0.1, 0.98, -0.2).normalize(),
    };
    let light = &scene.lighting.lights[0];
    let surface = surface_at(rectangle, 0, ray, 3.0, 1e-5);
    let block = SampleBlock {
        pattern: GRID,
        side: 4,
        first: 0,
        count: 16,
        group: 0,
        key: UVec2::ZERO,
    };
    let frustum = light_frustum(light, surface.ray_origin);
    let bound = scene.bounds[index_of_kind(ELLIPSOID)];

    let mut group = criterion.benchmark_group("twins");
    group.bench_function("intersect_rectangle", |b| {
        b.iter(|| intersect_rectangle(rectangle, black_box(ray), INFINITE_T))
    });
    group.bench_function("intersect_triangle", |b| {
        b.iter(|| intersect_triangle(triangle, black_box(ray), INFINITE_T))
    });
    group.bench_function("intersect_ellipsoid", |b| {
        b.iter(|| intersect_ellipsoid(ellipsoid, false, black_box(ray), INFINITE_T))
    });
    group.bench_function("may_block", |b| b.iter(|| may_block(&black_box(bound), &frustum)));
    group.bench_function("occlusion_mask of 16 samples, triangle", |b| {
        b.iter(|| occlusion_mask(TRIANGLE, triangle, black_box(surface.ray_origin), false, light, block))
    });
    group.bench_function("occlusion_mask of 16 samples, ellipsoid", |b| {
        b.iter(|| occlusion_mask(ELLIPSOID, ellipsoid, black_box(surface.ray_origin), false, light, block))
    });
    group.bench_function("phong_block of 16 samples", |b| {
        let segments = segments_to_light(light, surface.ray_origin);
        let no_lobes = Lobes {
            diffuse: 0.0,
            specular: 0.0,
        };
        b.iter(|| {
            phong_block(
                &surface,
                &scene.materials[0],
                segments,
                block,
                black_box(0),
                5,
                no_lobes,
            )
        })
    });
    group.finish();
}

/// Measures renders of full images. The throughput is in nominal rays: a camera ray per sample, and a shadow ray per
/// light sample.
fn images(criterion: &mut Criterion) {
    let device = gpu::choose(&AdapterChoice::Auto).expect("benchmarks need an adapter");
    let adapter = device.info.name.clone();
    for path in ["scenes/cornell.toml", "benches/peers/ellipsoids20.toml"] {
        let scene = scene(path, 128);
        let mut group = criterion.benchmark_group(path);
        let rays = 128 * 128 * u64::from(scene.sampling.pixel_samples) * (1 + scene.light_samples());
        group.throughput(Throughput::Elements(rays)).sample_size(20);
        let open_gpu = |baked| {
            let options = Options {
                baked,
                ..Options::best(&device)
            };
            Gpu::new(&device, &scene, &Shaders::built_in(), options).expect("the project's shaders compile")
        };
        let backends: [(String, Box<dyn Backend>); 3] = [
            (format!("{adapter}, scene as constants"), Box::new(open_gpu(true))),
            (format!("{adapter}, scene in buffers"), Box::new(open_gpu(false))),
            ("cpu".to_string(), Box::new(Cpu::new(&scene))),
        ];
        for (name, mut backend) in backends {
            group.bench_function(name, |b| {
                b.iter(|| {
                    let region = Region::whole(128, 128);
                    let samples = scene.sampling.pixel_samples;
                    job::render(
                        backend.as_mut(),
                        region,
                        samples,
                        &WorkSplit::default(),
                        &mut |_| true,
                        &mut |film| {
                            black_box(film);
                            Ok(())
                        },
                    )
                    .expect("the job is not cancelled")
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, peak, twins, images);
criterion_main!(benches);
