// Cloth in Filament: a picture of what `sateen export --format raw` wrote, drawn without a window.
//
//     cloth NAME.bin.json OUT.png [--scene sphere|curtain] [--size ROWS]
//
// NAME.bin lies beside NAME.bin.json. The sphere is that of `sateen render sphere --light-deg 30`, so that both can be compared.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Before Filament, which has a macro of a name that this uses.
#include <nlohmann/json.hpp>

#include <backend/PixelBufferDescriptor.h>
#include <filament/Camera.h>
#include <filament/Engine.h>
#include <filament/IndexBuffer.h>
#include <filament/Material.h>
#include <filament/MaterialInstance.h>
#include <filament/RenderableManager.h>
#include <filament/Renderer.h>
#include <filament/Scene.h>
#include <filament/SwapChain.h>
#include <filament/Texture.h>
#include <filament/TextureSampler.h>
#include <filament/VertexBuffer.h>
#include <filament/View.h>
#include <filament/Viewport.h>
#include <geometry/SurfaceOrientation.h>
#include <math/vec3.h>
#include <math/vec4.h>
#include <stb/stb_image_write.h>
#include <utils/EntityManager.h>

using namespace filament;
using namespace filament::math;

namespace {

const float PI = 3.14159265f;

std::vector<char> read(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file || bytes.empty()) {
        throw std::runtime_error("cannot read " + path);
    }
    return bytes;
}

/// Hands bytes over to Filament, which frees them once it has copied them.
template <typename T, typename Descriptor, typename... Args>
Descriptor lend(std::vector<T> data, Args... args) {
    auto *kept = new std::vector<T>(std::move(data));
    const auto free = [](void *, size_t, void *kept) { delete static_cast<std::vector<T> *>(kept); };
    return Descriptor(kept->data(), kept->size() * sizeof(T), args..., free, kept);
}

// ---- Cloth: a texture of three axes, and numbers.

struct Cloth {
    Texture *volume;
    Texture *numbers;
};

Texture *texture(Engine &engine, Texture::Sampler kind, uint3 size, Texture::InternalFormat format, Texture::Type type,
                 std::vector<char> texels) {
    Texture *made = Texture::Builder()
                        .sampler(kind)
                        .width(size.x)
                        .height(size.y)
                        .depth(size.z)
                        .format(format)
                        .build(engine);
    auto pixels = lend<char, Texture::PixelBufferDescriptor>(std::move(texels), Texture::Format::RGBA, type);
    if (kind == Texture::Sampler::SAMPLER_3D) {
        made->setImage(engine, 0, 0, 0, 0, size.x, size.y, size.z, std::move(pixels));
    } else {
        made->setImage(engine, 0, std::move(pixels));
    }
    return made;
}

Cloth load(Engine &engine, const std::string &path) {
    const std::vector<char> text = read(path);
    const auto said = nlohmann::json::parse(text.begin(), text.end());
    const auto size = said.at("size").get<std::vector<uint32_t>>();
    if (said.at("layout") != "volume" || said.at("pixels") != "RGBA16F" || size.size() != 3) {
        throw std::runtime_error(path + " is not of `sateen export --format raw`");
    }
    std::vector<char> texels = read(path.substr(0, path.rfind('.')));
    if (texels.size() != size_t(8) * size[0] * size[1] * size[2]) {
        throw std::runtime_error("the texels beside " + path + " are not complete");
    }
    // Rows of 256 numbers of four floats, as cloth.mat reads them.
    std::vector<float> numbers;
    for (const auto &four : said.at("parameters").get<std::vector<std::array<float, 4>>>()) {
        numbers.insert(numbers.end(), four.begin(), four.end());
    }
    const auto rows = uint32_t((numbers.size() + 1023) / 1024);
    numbers.resize(size_t(1024) * rows);
    const auto *bytes = reinterpret_cast<const char *>(numbers.data());
    return {texture(engine, Texture::Sampler::SAMPLER_3D, {size[0], size[1], size[2]}, Texture::InternalFormat::RGBA16F,
                    Texture::Type::HALF, std::move(texels)),
            texture(engine, Texture::Sampler::SAMPLER_2D, {256, rows, 1}, Texture::InternalFormat::RGBA32F,
                    Texture::Type::FLOAT, {bytes, bytes + numbers.size() * sizeof(float)})};
}

MaterialInstance *material(Engine &engine, const Cloth &cloth) {
    const std::vector<char> package = read(CLOTH_MATERIAL);
    MaterialInstance *made =
        Material::Builder().package(package.data(), package.size()).build(engine)->createInstance();
    // Linear between texels, no mips; clamped to the edge is the default.
    const TextureSampler linear(TextureSampler::MinFilter::LINEAR, TextureSampler::MagFilter::LINEAR);
    const TextureSampler none(TextureSampler::MinFilter::NEAREST, TextureSampler::MagFilter::NEAREST);
    made->setParameter("volume", cloth.volume, linear);
    made->setParameter("numbers", cloth.numbers, none);
    made->setParameter("irradiance", float3(PI));
    return made;
}

// ---- What it lies on.

struct Vertex {
    float3 position;
    float3 normal;
    /// In the direction of the warp threads.
    float3 warp;
};

/// The warp points right at the pole that faces the camera, and is carried from there along great circles.
Vertex sphere(float u, float v) {
    const float theta = PI * u, phi = 2 * PI * v;
    const float s = std::sin(theta), c = std::cos(theta), x = std::cos(phi), y = std::sin(phi);
    const float3 normal = {s * x, s * y, c};
    return {0.96f * normal, normal, {1 - (1 - c) * x * x, -(1 - c) * x * y, -s * x}};
}

/// Pleats; the warp hangs down.
Vertex curtain(float u, float v) {
    const float pleats = 14 * PI, depth = 0.06f;
    const float slope = -depth * pleats / 1.8f * std::sin(pleats * v);
    return {{1.8f * v - 0.9f, 0.9f - 1.8f * u, depth * std::cos(pleats * v)},
            normalize(float3{-slope, 0, 1}),
            {0, -1, 0}};
}

utils::Entity sheet(Engine &engine, Vertex (*at)(float, float), uint32_t rows, uint32_t columns,
                    MaterialInstance *material) {
    std::vector<float3> positions, normals;
    std::vector<float4> tangents;
    std::vector<uint32_t> corners;
    for (uint32_t row = 0; row <= rows; ++row) {
        for (uint32_t column = 0; column <= columns; ++column) {
            const Vertex vertex = at(float(row) / float(rows), float(column) / float(columns));
            positions.push_back(vertex.position);
            normals.push_back(vertex.normal);
            // w: which side of the warp the weft lies on, mirrored where texture coordinates are.
            tangents.emplace_back(vertex.warp, 1.0f);
            if (row < rows && column < columns) {
                const uint32_t a = row * (columns + 1) + column, c = a + columns + 1;
                corners.insert(corners.end(), {a, c, a + 1, a + 1, c, c + 1});
            }
        }
    }
    // Filament keeps frames as quaternions.
    std::vector<quatf> frames(positions.size());
    auto *orientation = geometry::SurfaceOrientation::Builder()
                            .vertexCount(positions.size())
                            .normals(normals.data())
                            .tangents(tangents.data())
                            .build();
    orientation->getQuats(frames.data(), frames.size());
    delete orientation;

    const size_t corner_count = corners.size();
    VertexBuffer *vertices = VertexBuffer::Builder()
                                 .vertexCount(uint32_t(positions.size()))
                                 .bufferCount(2)
                                 .attribute(POSITION, 0, VertexBuffer::AttributeType::FLOAT3)
                                 .attribute(TANGENTS, 1, VertexBuffer::AttributeType::FLOAT4)
                                 .build(engine);
    vertices->setBufferAt(engine, 0, lend<float3, VertexBuffer::BufferDescriptor>(std::move(positions)));
    vertices->setBufferAt(engine, 1, lend<quatf, VertexBuffer::BufferDescriptor>(std::move(frames)));
    IndexBuffer *indices = IndexBuffer::Builder().indexCount(uint32_t(corner_count)).build(engine);
    indices->setBuffer(engine, lend<uint32_t, IndexBuffer::BufferDescriptor>(std::move(corners)));

    const utils::Entity entity = utils::EntityManager::get().create();
    RenderableManager::Builder(1)
        .boundingBox({{0, 0, 0}, {1, 1, 1}})
        .material(0, material)
        .geometry(0, RenderableManager::PrimitiveType::TRIANGLES, vertices, indices)
        .build(engine, entity);
    return entity;
}

// ---- The picture.

struct Arguments {
    std::string json, picture;
    std::string scene = "sphere";
    uint32_t size = 512;
};

Arguments parse(int count, char **words) {
    const char *usage = "usage: cloth NAME.bin.json OUT.png [--scene sphere|curtain] [--size ROWS]";
    const std::vector<std::string> all(words + 1, words + count);
    if (all.size() < 2 || all.size() % 2 != 0) {
        throw std::runtime_error(usage);
    }
    Arguments arguments;
    arguments.json = all[0];
    arguments.picture = all[1];
    for (size_t k = 2; k < all.size(); k += 2) {
        const std::string &name = all[k], &value = all[k + 1];
        if (name == "--scene" && (value == "sphere" || value == "curtain")) {
            arguments.scene = value;
        } else if (name == "--size" && std::atoi(value.c_str()) > 0) {
            arguments.size = uint32_t(std::atoi(value.c_str()));
        } else {
            throw std::runtime_error(usage);
        }
    }
    return arguments;
}

/// RGBA, the first row at the top.
std::vector<uint8_t> draw(Engine &engine, const Arguments &arguments) {
    const uint32_t size = arguments.size;
    SwapChain *swap_chain = engine.createSwapChain(size, size, SwapChain::CONFIG_READABLE);
    Renderer *renderer = engine.createRenderer();
    Scene *scene = engine.createScene();
    View *view = engine.createView();
    Camera *camera = engine.createCamera(utils::EntityManager::get().create());
    view->setScene(scene);
    view->setCamera(camera);
    view->setViewport({0, 0, size, size});
    // The material makes display values itself.
    view->setPostProcessingEnabled(false);
    Renderer::ClearOptions clear;
    clear.clear = true;
    renderer->setClearOptions(clear);

    const Cloth cloth = load(engine, arguments.json);
    MaterialInstance *instance = material(engine, cloth);
    if (arguments.scene == "sphere") {
        // As the camera of `sateen render`; from far away, since view vectors lead to where it is in spite of its projection.
        camera->setProjection(Camera::Projection::ORTHO, -1, 1, -1, 1, 999, 1001);
        camera->lookAt({0, 0, 1000}, {0, 0, 0});
        instance->setParameter("light", float3(0.5f, 0, std::sqrt(0.75f)));
        scene->addEntity(sheet(engine, sphere, 128, 192, instance));
    } else {
        camera->setProjection(40, 1, 0.1, 10);
        camera->lookAt({-0.9f, 0.4f, 3}, {0, 0, 0});
        instance->setParameter("light", normalize(float3(0.3f, 0.4f, 1)));
        scene->addEntity(sheet(engine, curtain, 32, 512, instance));
    }

    std::vector<uint8_t> pixels(size_t(4) * size * size);
    bool is_read = false;
    const auto done = [](void *, size_t, void *is_read) { *static_cast<bool *>(is_read) = true; };
    // The first frames of a swap chain may be skipped.
    for (bool is_drawn = false; !is_drawn;) {
        if (renderer->beginFrame(swap_chain)) {
            renderer->render(view);
            renderer->readPixels(0, 0, size, size,
                                 {pixels.data(), pixels.size(), Texture::Format::RGBA, Texture::Type::UBYTE, done,
                                  &is_read});
            renderer->endFrame();
            is_drawn = true;
        }
        engine.flushAndWait();
    }
    while (!is_read) {
        engine.flushAndWait();
        engine.execute();
    }
    return pixels;
}

} // namespace

int main(int count, char **words) {
    try {
        const Arguments arguments = parse(count, words);
        const auto close = [](Engine *engine) { Engine::destroy(&engine); };
        const std::unique_ptr<Engine, decltype(close)> engine(Engine::create(Engine::Backend::OPENGL), close);
        if (!engine) {
            throw std::runtime_error("Filament finds no OpenGL; without a screen, start this by xvfb-run");
        }
        const std::vector<uint8_t> pixels = draw(*engine, arguments);
        const int side = int(arguments.size);
        if (stbi_write_png(arguments.picture.c_str(), side, side, 4, pixels.data(), 4 * side) == 0) {
            throw std::runtime_error("cannot write " + arguments.picture);
        }
    } catch (const std::exception &error) {
        std::cerr << "cloth: " << error.what() << '\n';
        return 1;
    }
}
