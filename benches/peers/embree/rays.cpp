// Embree 3's single-ray calls on the meshes and rays that `cargo bench --bench rays` writes. One thread, robust mode,
// medium build quality. First line out: build seconds, megabytes that the device holds, triangles. Then for each number
// of a ray set on standard input: seconds, hits, sum of hit distances. Anything else ends it.
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <vector>

static std::atomic<int64_t> device_bytes{0};

static bool on_memory(void*, ssize_t bytes, bool) {
    device_bytes += bytes;
    return true;
}

// CPU time of this thread: what other programs on the machine do does not count.
static double seconds_now() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

static std::vector<uint32_t> read_words(const char* path) {
    FILE* file = std::fopen(path, "rb");
    if (!file) {
        std::perror(path);
        std::exit(2);
    }
    std::fseek(file, 0, SEEK_END);
    std::vector<uint32_t> words(static_cast<size_t>(std::ftell(file)) / 4);
    std::rewind(file);
    if (std::fread(words.data(), 4, words.size(), file) != words.size()) std::exit(2);
    std::fclose(file);
    return words;
}

struct InputRay {
    float origin[3], direction[3], t_max, any;
};

int main(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(stderr, "usage: embree-rays MESH RAYS...\n");
        return 2;
    }
    std::vector<uint32_t> mesh = read_words(argv[1]);
    const uint32_t vertices = mesh[0], triangles = mesh[1];
    // Embree reads 16 bytes at the last vertex.
    std::vector<uint32_t> positions(mesh.begin() + 2, mesh.begin() + 2 + 3 * vertices);
    positions.resize(positions.size() + 4);

    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = nullptr;
    double build_seconds = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 3; ++round) {
        if (scene) rtcReleaseScene(scene);
        if (round == 2) rtcSetDeviceMemoryMonitorFunction(device, on_memory, nullptr);
        scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(), 0, 12,
                                   vertices);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.data() + 2 + 3 * vertices,
                                   0, 12, triangles);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        const double start = seconds_now();
        rtcCommitScene(scene);
        build_seconds = std::min(build_seconds, seconds_now() - start);
    }
    std::vector<std::vector<uint32_t>> sets;
    for (int i = 2; i < argc; ++i) sets.push_back(read_words(argv[i]));
    std::printf("%.6f %.3f %u\n", build_seconds, static_cast<double>(device_bytes.load()) / 1e6, triangles);
    std::fflush(stdout);

    unsigned number;
    while (std::scanf("%u", &number) == 1 && number < sets.size()) {
        const InputRay* rays = reinterpret_cast<const InputRay*>(sets[number].data());
        const size_t count = sets[number].size() / 8;
        uint64_t hits = 0;
        double distance = 0.0;
        const double start = seconds_now();
        for (size_t i = 0; i < count; ++i) {
            const InputRay& in = rays[i];
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            RTCRayHit query;
            query.ray.org_x = in.origin[0];
            query.ray.org_y = in.origin[1];
            query.ray.org_z = in.origin[2];
            query.ray.dir_x = in.direction[0];
            query.ray.dir_y = in.direction[1];
            query.ray.dir_z = in.direction[2];
            query.ray.tnear = 0.0f;
            query.ray.tfar = in.t_max;
            query.ray.time = 0.0f;
            query.ray.mask = ~0u;
            query.ray.flags = 0;
            query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            if (in.any != 0.0f) {
                rtcOccluded1(scene, &context, &query.ray);
                hits += query.ray.tfar < 0.0f;
            } else {
                rtcIntersect1(scene, &context, &query);
                if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
                    ++hits;
                    distance += query.ray.tfar;
                }
            }
        }
        std::printf("%.6f %llu %.6f\n", seconds_now() - start, static_cast<unsigned long long>(hits), distance);
        std::fflush(stdout);
    }
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
