#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sequence/sequence_report.h"
#include "variolux/base/image.h"

namespace vlx {

/// The report as one HTML page: numbers, error against frame, and all frames side by side, played at a speed
/// that can be chosen. Sources: tools/sequence/page.
class SequencePage {
  public:
    /// Of `frames` frames of `images` images each, the reference among them, of this window: the more there
    /// are, the smaller they are in the page, which then says so.
    SequencePage(const Window& window, std::size_t frames, std::size_t images);

    /// The images of the next frame, the reference first, as colourOf() returns them.
    void add(const std::vector<Image>& images);

    std::string html(const SequenceReport& report) const;

  private:
    int factor_;
    std::vector<nlohmann::ordered_json> images_;  // of each image: of each frame
};

}  // namespace vlx
