#include "exr/raw_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "variolux/base/error.h"

namespace vlx {

RawFile::RawFile(std::string name, const std::string& path, Mode mode)
    : name_(std::move(name)),
      descriptor_(::open(path.c_str(), (mode == Mode::Read ? O_RDONLY : O_RDWR) | O_CLOEXEC)) {
    if (descriptor_ < 0) refuse("opening");
    struct stat status {};
    if (::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)) return;
    ::close(descriptor_);
    throw Error(name_, "expected a regular file, found something else");
}

RawFile::~RawFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint64_t RawFile::size() const {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) refuse("reading");
    return static_cast<std::uint64_t>(status.st_size);
}

void RawFile::readAt(std::uint64_t position, std::span<unsigned char> to) const {
    for (std::size_t done = 0; done < to.size();) {
        const ssize_t got =
            ::pread(descriptor_, to.data() + done, to.size() - done, static_cast<off_t>(position + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) refuse("reading");
        if (got == 0) throw Error(name_, "truncated: the file became shorter while it was read");
        done += static_cast<std::size_t>(got);
    }
}

void RawFile::writeAt(std::uint64_t position, std::span<const unsigned char> bytes) const {
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t put = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                     static_cast<off_t>(position + done));
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) refuse("writing");
        done += static_cast<std::size_t>(put);
    }
}

void RawFile::close() {
    if (::close(std::exchange(descriptor_, -1)) != 0) refuse("writing");
}

void RawFile::refuse(const char* what) const {
    throw Error(name_, std::string(what) + " failed: " + std::strerror(errno));
}

}  // namespace vlx
