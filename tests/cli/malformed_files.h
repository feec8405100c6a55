#pragma once

#include <string>
#include <vector>

namespace vlx {

enum class MalformedKind { Dump, Image, BcdRaw, Sbmc, Gltf };

/// A file that is wrong in one way, which its name says.
struct MalformedFile {
    MalformedKind kind;
    std::string name;
    std::vector<unsigned char> bytes;
};

/// About two hundred of them, the same in every run: small valid files of each kind, each damaged by hand in
/// one place.
std::vector<MalformedFile> malformedFiles();

}  // namespace vlx
