// The radiance of a row of pixels, on two threads that share a table:
//
//     shade_cpp TABLE
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <thread>
#include <vector>

#include "sateen.hpp"

namespace {

constexpr int PIXELS = 37;
constexpr sateen::Vec3 LIGHT{0.36f, 0.48f, 0.8f};

sateen::Vec3 viewer(int pixel) {
    const float x = -0.95f + 1.9f * static_cast<float>(pixel) / static_cast<float>(PIXELS - 1);
    return {x, 0.0f, std::sqrt(1.0f - x * x)};
}

void shade(const char *path) {
    const sateen::Table table(path);
    std::vector<sateen::Vec3> row(PIXELS);
    const auto half = [&](int from, int to) {
        for (int pixel = from; pixel < to; ++pixel) {
            row[static_cast<std::size_t>(pixel)] = table.eval_cos(LIGHT, viewer(pixel));
        }
    };
    std::thread other(half, 0, PIXELS / 2);
    half(PIXELS / 2, PIXELS);
    other.join();
    for (int pixel = 0; pixel < PIXELS; ++pixel) {
        std::printf("pixel %2d", pixel);
        for (const float channel : row[static_cast<std::size_t>(pixel)]) {
            std::uint32_t bits;
            std::memcpy(&bits, &channel, sizeof bits);
            std::printf("  %.6f %08x", static_cast<double>(channel), static_cast<unsigned>(bits));
        }
        std::printf("\n");
    }
}

}  // namespace

int main(int argc, char **argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: shade_cpp TABLE\n");
        return 2;
    }
    try {
        shade(argv[1]);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "shade_cpp: %s\n", error.what());
        return 1;
    }
    return 0;
}
