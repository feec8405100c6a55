#include "variolux/base/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "variolux/base/error.h"

namespace vlx {

namespace fs = std::filesystem;

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
    const fs::path target(path_);
    if (target.filename().empty()) throw Error(path_, "expected the name of an output file, found none");
    std::error_code ignored;
    const fs::file_status found = fs::status(target, ignored);
    if (fs::is_directory(found)) throw Error(path_, "expected the name of an output file, found a folder");
    // The finished file takes the name over: a device such as /dev/null would be gone.
    if (fs::exists(found) && !fs::is_regular_file(found))
        throw Error(path_, "expected the name of an output file, found a device or a pipe");
    // Two processes that write the same file must not share a temporary one: the process id tells them apart.
    const fs::path name = "." + target.stem().string() + "." + std::to_string(::getpid()) + ".partial" +
                          target.extension().string();
    temporary_ = (target.parent_path() / name).string();
    const int descriptor = ::open(temporary_.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0)
        throw Error(path_, std::string("expected to create this file: ") + std::strerror(errno));
    ::close(descriptor);
}

OutputFile::~OutputFile() {
    if (!committed_) ::unlink(temporary_.c_str());
}

void OutputFile::commit() {
    const int descriptor = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0)
        throw Error(path_, std::string("the file vanished while it was written: ") + std::strerror(errno));
    const bool synced = ::fsync(descriptor) == 0;
    const int code = errno;
    ::close(descriptor);
    if (!synced) throw Error(path_, std::string("writing to disk failed: ") + std::strerror(code));
    if (std::rename(temporary_.c_str(), path_.c_str()) != 0)
        throw Error(path_,
                    std::string("expected to give the finished file its name: ") + std::strerror(errno));
    committed_ = true;
}

}  // namespace vlx
