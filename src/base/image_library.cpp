#include "base/image_library.h"

#include <dlfcn.h>

#include <algorithm>

#include "variolux/base/error.h"

namespace vlx {

namespace {

std::string lowerCase(std::string name) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return name;
}

}  // namespace

std::string ImageInfo::text(const std::string& name) const {
    const auto found = texts.find(lowerCase(name));
    return found == texts.end() ? std::string() : found->second;
}

std::optional<double> ImageInfo::number(const std::string& name) const {
    const auto found = numbers.find(lowerCase(name));
    return found == numbers.end() ? std::nullopt : std::optional<double>(found->second);
}

const ImageLibrary& imageLibrary() {
    static const ImageLibrary* const library = [] {
        // Found by the program's run path, which linking variolux::base sets. Never closed.
        constexpr const char* kName = VLX_MODULE_FOLDER "libvariolux_openimageio.so";
        void* const module = dlopen(kName, RTLD_NOW | RTLD_LOCAL);
        void* const entry = module ? dlsym(module, "variolux_image_library") : nullptr;
        if (!entry)
            throw Error(
                kName, std::string("expected the module for image files beside the libraries: ") + dlerror());
        return reinterpret_cast<const ImageLibrary* (*)()>(entry)();
    }();
    return *library;
}

}  // namespace vlx
