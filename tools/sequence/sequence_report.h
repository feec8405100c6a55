#pragma once

#include <string>
#include <vector>

#include "variolux/compare/sequence.h"

namespace vlx {

/// What `vlx-compare sequence` prints. Files are named by patterns, with #### for the frame's number.
struct SequenceReport {
    struct Entry {
        std::string path;
        std::string name;  ///< short, unique in the report
        SequenceErrors errors;
    };

    std::string reference;
    std::string motion;  ///< empty: none
    std::vector<int> frames;
    Window window;
    std::vector<Entry> sequences;
};

/// A table for people: relMSE frame by frame and of all, flicker, with their intervals; one column a
/// sequence.
std::string toText(const SequenceReport& report);

/// The same for machines, with all metrics of each frame. Numbers are finite or null.
std::string toJson(const SequenceReport& report);

}  // namespace vlx
