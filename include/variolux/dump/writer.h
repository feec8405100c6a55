#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "variolux/dump/band.h"
#include "variolux/dump/format.h"
#include "variolux/dump/splats.h"

namespace vlx {

/// Writes a dump as a two-part OpenEXR file, streaming: a flat `beauty` part that every viewer shows (FLOAT
/// R, G, B, A: the means of a pixel's finite samples, and Z: that of its hits, A > 0), the deep scanline part
/// `samples`, and with splats a flat part `splats`, of which `beauty` then holds the mean too. Compression
/// runs on parallelFor's threads, started by a thread of the writer's own, never on the caller's; memory is a
/// few bands, whatever the image's height (with splats, these and `beauty` too). The bytes written do not
/// depend on the bands' heights or the number of threads. The file appears under its name only after close().
///
/// Use: construct, write() bands of consecutive rows from the top to the bottom without gaps, close().
/// Destroyed before close(), it leaves no file. Not for use from two threads at once.
class DumpWriter {
  public:
    /// Throws Error on an unusable header (empty windows or such beyond OpenEXR's coordinates, no R, G or B,
    /// duplicate or invalid names, matrices not of 16 values) and when the file cannot be created.
    DumpWriter(const std::string& path, const DumpHeader& header);
    ~DumpWriter();
    DumpWriter(const DumpWriter&) = delete;
    DumpWriter& operator=(const DumpWriter&) = delete;

    /// Queues the next rows; waits when too many bands are queued (bounded memory). The band must span the
    /// data window's columns, start at the row after the last one written, and hold the header's channels in
    /// its order. Throws Error on a band that does not, and on an earlier background write that failed (full
    /// disk) or a row of more samples than OpenEXR can hold (2^31 bytes).
    void write(SampleBand band);

    /// The splats, once, before close(): required when the header has `splatReplicates`. Throws Error unless
    /// their window and number are the header's.
    void writeSplats(SplatImages splats);

    /// Waits for all bands, records `renderSeconds` in the header when positive, and gives the file its name.
    /// Throws Error when rows are missing or any write failed; then no file is left.
    void close(double renderSeconds = 0);

    /// Processor seconds that compression and writing have taken so far, on all threads of the writer.
    double cpuSeconds() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
