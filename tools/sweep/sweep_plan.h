#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sweep/sweep.h"
#include "sweep/sweep_images.h"
#include "variolux/base/window.h"

namespace vlx {

/// The layer of reconstructed images that holds the standard deviation of their error.

/// What a sweep is going to run, known before anything is run.
struct SweepPlan {
    SweepOptions options;  ///< with the defaults filled in
    bool fromDump = false;
    bool samplingTimeKnown = true;
    std::vector<SweepSampling> samplings;
    std::vector<int> frames;                 ///< none: one picture
    std::vector<ReferenceImage> references;  ///< one a frame, or one; none: no reference
    std::string inputIdentity, referenceIdentity;
    std::map<std::string, std::pair<std::string, std::string>> programs;  ///< name -> path, identity
    std::map<std::string, std::string> methodFiles;                       ///< by method
    int dumpSamples = 0;
    double meanSamples = 0;

    /// Of a dump no more than it has disjoint sub-sets.
    int repetitions(const SweepSampling& sampling) const;
    std::vector<const SweepMethod*> methodsFor(const SweepSampling& sampling) const;
    int countSteps() const;
    /// NAME.exr; with frames a pattern.
    std::string imageName(const std::string& name) const;
    /// The files of a pattern's frames; without frames its name alone.
    std::vector<std::string> files(const std::string& pattern) const;

    // Commands as people read them, with places for {input} and {output}.
    std::string samplingCommand(const SweepSampling& sampling, int seed) const;
    std::string methodCommand(const SweepMethod& method, const SweepSampling& sampling, int seed) const;
    /// A command for the shell, its program by its path.
    std::string executable(const std::string& command) const;

    // Of records: hashes of all that they depend on.
    std::string samplingKey(const std::string& command) const;
    std::string imageKey(const std::string& sampling, const SweepMethod& method,
                         const std::string& command) const;

    /// Throws Error unless the reference is of this part of the picture.
    void requireReferenceWindow(const Window& window) const;
};

/// Throws Error as runSweep() does before anything is run. `log` is told what is left out.
SweepPlan planSweep(SweepOptions options, const std::function<void(const std::string&)>& log);

}  // namespace vlx
