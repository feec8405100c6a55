// The loader of glTF scenes.

#include "fuzz_file.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static vlx::FuzzFile file(".gltf");
    try {
        vlx::render::loadScene(file.with(data, size));
    } catch (const vlx::Error&) {
    }
    return 0;
}
