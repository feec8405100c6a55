#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/dump/format.h"

namespace vlx {

/// The samples of a part of a picture, filled by one thread, then given to a SampleWriter.
class SampleTile {
  public:
    /// Adds a sample of pixel (x, y), in raster coordinates: one value for each of the header's channels, in
    /// its order. Pixels may come in any order, and as often as they have samples; not finite values are
    /// kept. Throws Error on a pixel outside the tile or another number of values.
    void add(int x, int y, std::span<const float> values);

    const Window& window() const { return window_; }
    std::size_t samples() const { return pixels_.size(); }

  private:
    friend class SampleWriter;
    SampleTile(const Window& window, std::size_t channels, std::uint32_t pass)
        : window_(window), channels_(channels), pass_(pass) {}

    Window window_;
    std::size_t channels_;
    std::uint32_t pass_;
    std::vector<std::uint32_t> pixels_;  // of each sample, counted row by row
    std::vector<float> values_;          // of each sample: one a channel
};

/// Writes a dump from a renderer that works tile by tile, in any order, on many threads: what DumpWriter,
/// which wants whole rows from the top, does not take.
///
///     vlx::DumpHeader header;
///     header.data = header.display = {0, 0, width, height};
///     header.channels = {{"R"}, {"G"}, {"B"}, {"sample.x"}, {"sample.y"}};
///     header.renderer = "Mine 1.0";
///     vlx::SampleWriter writer("samples.exr", header);
///     // on each thread, for each of its tiles:
///     vlx::SampleTile tile = writer.tile({x0, y0, 32, 32});
///     tile.add(x, y, std::array{r, g, b, x + dx, y + dy});      // once a camera ray
///     writer.add(std::move(tile));
///     // when all are done:
///     writer.close();
///
/// FORMAT.md says which channels there are and what they mean. Tiles go to a nameless file
/// beside the dump (as many bytes as the samples have) and become the dump in close(): memory is that of the
/// tiles being filled and a few rows. A pixel's samples are in the order of passes, then as they were added;
/// the dump's bytes do not depend on threads as long as tiles of one pass do not overlap. Pixels of no tile
/// have no samples. The file appears under its name only in close(); destroyed before, a writer leaves none.
class SampleWriter {
  public:
    /// Throws Error on an unusable header and when files cannot be created, as DumpWriter.
    SampleWriter(const std::string& path, const DumpHeader& header);
    ~SampleWriter();
    SampleWriter(const SampleWriter&) = delete;
    SampleWriter& operator=(const SampleWriter&) = delete;

    /// An empty tile, from any thread. `pass` tells tiles apart that cover the same pixels (progressive
    /// rendering). Throws Error on a window without pixels, of more than 2^31-1, or not within the data
    /// window.
    SampleTile tile(const Window& window, std::uint32_t pass = 0) const;

    /// Takes a filled tile, from any thread. Throws Error when the disk refuses and after close().
    void add(SampleTile tile);

    /// Writes the dump and gives it its name; nobody may call add() meanwhile. Throws Error as DumpWriter.
    void close(double renderSeconds = 0);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
