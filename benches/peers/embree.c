// Times Embree's single rays on the bounced rays of `benches/trees.rs`: the same mesh, camera and directions.
//
//     benches/peers/embree
//
// Prints the number of rays and hits, and nanoseconds per closest-hit query with one thread: the minimum of 20 rounds.
#include <embree3/rtcore.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { ROWS = 132, COLUMNS = 2 * ROWS, SIDE = 512, ROUNDS = 20 };
enum { SPHERE_VERTICES = (COLUMNS + 1) * (ROWS + 1), SPHERE_TRIANGLES = 2 * COLUMNS * ROWS };

typedef struct {
    float x, y, z;
} Vec;

static Vec add(Vec a, Vec b) { return (Vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec scaled(Vec a, float s) { return (Vec){a.x * s, a.y * s, a.z * s}; }
static float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec unit(Vec a) { return scaled(a, 1 / sqrtf(dot(a, a))); }
static Vec cross(Vec a, Vec b) {
    return (Vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static const Vec EYE = {0, -4.5f, 1.5f};

static float random_number(uint32_t pixel, uint32_t salt) {
    uint32_t x = pixel * 0x9e3779b9u ^ salt;
    x = (x ^ x >> 15) * 0x85ebca6bu;
    x = (x ^ x >> 15) * 0xc2b2ae35u;
    return (float)(x >> 8) / 16777216.0f;
}

static RTCScene build(RTCDevice device, enum RTCBuildQuality quality, enum RTCSceneFlags flags) {
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    Vec *v = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec), SPHERE_VERTICES + 4);
    uint32_t(*t)[3] = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, SPHERE_TRIANGLES + 2);
    for (int y = 0; y <= ROWS; y++) {
        for (int x = 0; x <= COLUMNS; x++) {
            float a = (float)y / ROWS * (float)M_PI, b = (float)x / COLUMNS * 2 * (float)M_PI;
            Vec d = {sinf(a) * cosf(b), sinf(a) * sinf(b), cosf(a)};
            *v++ = scaled(d, 1 + 0.03f * sinf(20 * d.x) * sinf(23 * d.y) * cosf(17 * d.z));
        }
    }
    for (uint32_t y = 0; y < ROWS; y++) {
        for (uint32_t x = 0; x < COLUMNS; x++) {
            uint32_t i = y * (COLUMNS + 1) + x;
            uint32_t below = i + COLUMNS + 1;
            (*t)[0] = i, (*t)[1] = i + 1, (*t)[2] = below + 1, t++;
            (*t)[0] = i, (*t)[1] = below + 1, (*t)[2] = below, t++;
        }
    }
    *v++ = (Vec){-5, -5, -1.05f}, *v++ = (Vec){5, -5, -1.05f}, *v++ = (Vec){5, 5, -1.05f}, *v++ = (Vec){-5, 5, -1.05f};
    uint32_t first = SPHERE_VERTICES;
    (*t)[0] = first, (*t)[1] = first + 1, (*t)[2] = first + 2, t++;
    (*t)[0] = first, (*t)[1] = first + 2, (*t)[2] = first + 3, t++;
    rtcSetGeometryBuildQuality(mesh, quality);
    rtcCommitGeometry(mesh);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, quality);
    rtcSetSceneFlags(scene, flags);
    rtcAttachGeometry(scene, mesh);
    rtcCommitScene(scene);
    return scene;
}

static struct RTCRayHit ray_of(Vec origin, Vec direction) {
    struct RTCRayHit r = {0};
    r.ray.org_x = origin.x, r.ray.org_y = origin.y, r.ray.org_z = origin.z;
    r.ray.dir_x = direction.x, r.ray.dir_y = direction.y, r.ray.dir_z = direction.z;
    r.ray.tfar = INFINITY, r.ray.mask = -1;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return r;
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

static void measure(RTCDevice device, const char *name, enum RTCBuildQuality quality, enum RTCSceneFlags flags) {
    RTCScene scene = build(device, quality, flags);
    struct RTCRayHit *rays = aligned_alloc(16, sizeof(struct RTCRayHit) * SIDE * SIDE);
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    Vec forward = unit(add((Vec){0, 0, -0.1f}, scaled(EYE, -1)));
    Vec right = unit(cross(forward, (Vec){0, 0, 1})), up = cross(right, forward);
    int count = 0;
    for (uint32_t pixel = 0; pixel < SIDE * SIDE; pixel++) {
        float x = ((pixel % SIDE + 0.5f) / SIDE - 0.5f) * 0.76f, y = ((pixel / SIDE + 0.5f) / SIDE - 0.5f) * 0.76f;
        Vec direction = add(forward, add(scaled(right, x), scaled(up, -y)));
        struct RTCRayHit camera = ray_of(EYE, direction);
        rtcIntersect1(scene, &context, &camera);
        if (camera.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
            continue;
        }
        Vec normal = unit((Vec){camera.hit.Ng_x, camera.hit.Ng_y, camera.hit.Ng_z});
        normal = scaled(normal, dot(normal, direction) > 0 ? -1 : 1);
        float z = 1 - 2 * random_number(pixel, 1), angle = 2 * (float)M_PI * random_number(pixel, 2), r = sqrtf(1 - z * z);
        Vec origin = add(add(EYE, scaled(direction, camera.ray.tfar)), scaled(normal, 1e-4f));
        rays[count++] = ray_of(origin, add(normal, (Vec){r * cosf(angle), r * sinf(angle), z}));
    }
    double best = INFINITY;
    int hits = 0;
    for (int round = 0; round < ROUNDS; round++) {
        double start = seconds();
        hits = 0;
        for (int i = 0; i < count; i++) {
            struct RTCRayHit ray = rays[i];
            rtcIntersect1(scene, &context, &ray);
            hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
        best = fmin(best, seconds() - start);
    }
    printf("Embree %d.%d.%d, %s: %d of %d rays hit, %.0f ns per ray\n", RTC_VERSION_MAJOR, RTC_VERSION_MINOR,
           RTC_VERSION_PATCH, name, hits, count, 1e9 * best / count);
    free(rays);
    rtcReleaseScene(scene);
}

int main(void) {
    RTCDevice device = rtcNewDevice("threads=1");
    measure(device, "medium quality", RTC_BUILD_QUALITY_MEDIUM, RTC_SCENE_FLAG_NONE);
    measure(device, "high quality, robust", RTC_BUILD_QUALITY_HIGH, RTC_SCENE_FLAG_ROBUST);
    rtcReleaseDevice(device);
}
