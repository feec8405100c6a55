#pragma once

#include <memory>
#include <string>
#include <vector>

#include "import/stack/plan.h"

namespace vlx {

/// A flat file of what the images have, as one image: the mean of them all (PassKind says what else), their
/// contributions in place of the passes that these are made of, cryptomattes merged by coverage; types of
/// channels, compression (lossy ones become ZIP) and attributes of the first image. For `vlx-krige
/// --template`.
class PassFile {
  public:
    /// Takes all channels of the images. `samples`: of the renderer, of all images; 0: not known. Throws
    /// Error when the file cannot be created, or the first image is not OpenEXR.
    PassFile(const std::string& path, FlatImages& images, const StackPlan& plan, double samples,
             const std::string& inputs);
    ~PassFile();
    PassFile(const PassFile&) = delete;
    PassFile& operator=(const PassFile&) = delete;

    /// Writes the rows read last: the next ones from the top. Throws Error.
    void write(int rows);
    /// Gives the file its name. Throws Error.
    void close();

    /// What could not be kept, and passes that no image has; `added`: to earlier images, which may have them.
    std::vector<std::string> notes(bool added) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
