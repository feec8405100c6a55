#pragma once

#include <OpenEXR/ImfHeader.h>

#include <set>
#include <string>

namespace vlx {

/// The header without these attributes. What Imf::Header::erase() of OpenEXR 3.1 takes away it never frees.
inline Imf::Header headerWithout(const Imf::Header& header, const std::set<std::string>& names) {
    Imf::Header rest;
    for (auto it = header.begin(); it != header.end(); ++it)
        if (!names.contains(it.name())) rest.insert(it.name(), it.attribute());
    return rest;
}

}  // namespace vlx
