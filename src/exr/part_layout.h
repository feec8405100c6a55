#pragma once

#include <string>
#include <vector>

#include "variolux/base/window.h"

namespace vlx {

/// A file that holds a part of a picture.
struct PicturePart {
    std::string path;
    Window data;
};

/// Sorts the parts by their corners, by rows first. Throws Error (of `output` where no single part is wrong)
/// when two overlap or when they do not fill `whole`, naming a place where something is missing.
void arrangeParts(std::vector<PicturePart>& parts, const Window& whole, const std::string& output);

/// The smallest window that holds them all.
Window boundsOf(const std::vector<PicturePart>& parts);

}  // namespace vlx
