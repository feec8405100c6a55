#pragma once

#include <map>
#include <string>
#include <vector>

#include "variolux/base/progress.h"
#include "variolux/dump/format.h"
#include "variolux/dump/sample_source.h"

namespace vlx {

/// Which channels of an image hold what: dump channel -> image channel, for example {"albedo.R",
/// "ViewLayer.Denoising Albedo.R"}. Values are taken as they are, or times a factor: {"motion.y",
/// "-1*flow.y"}.
using ChannelMap = std::map<std::string, std::string>;

/// What an importer did, for a person to check. Every importer returns one.
struct ImportReport {
    ChannelMap mapped;                 ///< what was taken from where
    std::vector<std::string> ignored;  ///< what the source has and the dump has not
    std::vector<std::string> notes;    ///< decisions worth telling, one sentence each
    std::vector<MissingPart> missing;  ///< what the source lacks, and what that costs
};

/// Samples made of other files as they are asked for: what the importer of the same name would write into a
/// dump, bit for bit.
class ImportedSamples : public SampleSource {
  public:
    /// What was taken from where; counts are of the rows read so far.
    virtual ImportReport report() const = 0;
};

/// Files of an image sequence. A path whose file name holds a run of '#' stands for all files whose name has
/// a number of at least as many digits there (more only without a leading zero), in numeric order; one whose
/// name holds '*' or '?' stands for all files that fit, those of shorter names first; other paths, and those
/// of files that are there, stand for themselves. Throws Error when no file fits a pattern, and when a name
/// has both: with --frames the number is a frame's.
std::vector<std::string> expandSequences(const std::vector<std::string>& paths);

}  // namespace vlx
