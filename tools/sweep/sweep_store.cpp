#include "sweep/sweep_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "variolux/base/error.h"
#include "variolux/base/hash.h"

namespace vlx {

namespace {

constexpr std::uintmax_t kHashedWhole = std::uintmax_t{64} << 20;
constexpr std::size_t kHashedHead = std::size_t{1} << 20;

}  // namespace

std::uint64_t textHash(std::string_view text, std::uint64_t hash) {
    for (const char c : text) hash = hashOf(hash, static_cast<unsigned char>(c));
    return hashOf(hash, static_cast<std::uint64_t>(text.size()));
}

std::string hexText(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
    return text;
}

std::string fileIdentity(const std::string& path) {
    struct stat status {};
    std::ifstream file(path, std::ios::binary);
    if (!file || ::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
        throw Error(path, "expected a file that can be read");
    const auto size = static_cast<std::uintmax_t>(status.st_size);
    std::string head(size <= kHashedWhole ? size : kHashedHead, '\0');
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    if (!file) throw Error(path, "reading failed");
    std::uint64_t hash = hashOf(size);
    for (std::size_t i = 0; i + 8 <= head.size(); i += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, head.data() + i, 8);
        hash = hashOf(hash, word);
    }
    hash = textHash(std::string_view(head).substr(head.size() / 8 * 8), hash);
    if (size > kHashedWhole) hash = hashOf(hash, status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
    return hexText(hash);
}

ResultsFile::Descriptor::~Descriptor() {
    if (value >= 0) ::close(value);
}

ResultsFile::ResultsFile(const std::string& path, bool anew) : path_(path) {
    const auto fail = [&] { throw Error(path, std::string("cannot be written: ") + std::strerror(errno)); };
    fd_.value = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd_.value < 0) fail();
    if (::flock(fd_.value, LOCK_EX | LOCK_NB) != 0)
        throw Error(path, "another sweep is working in this folder");
    std::ifstream file(path, std::ios::binary);
    std::uintmax_t complete = 0;
    for (std::string line; std::getline(file, line) && !file.eof();) {
        complete += line.size() + 1;
        const SweepRecord record = parseRecord(line, path);
        records_[record.key] = record;
    }
    if (anew) {
        records_.clear();
        complete = 0;
    }
    if (::ftruncate(fd_.value, static_cast<off_t>(complete)) != 0 || ::lseek(fd_.value, 0, SEEK_END) < 0)
        fail();
}

const SweepRecord* ResultsFile::find(const std::string& key) const {
    const auto found = records_.find(key);
    return found == records_.end() || !found->second.failure.empty() ? nullptr : &found->second;
}

void ResultsFile::add(const SweepRecord& record) {
    const std::string line = toJsonLine(record) + "\n";
    if (::write(fd_.value, line.data(), line.size()) != static_cast<ssize_t>(line.size()) ||
        ::fsync(fd_.value) != 0)
        throw Error(path_, "writing failed");
    records_[record.key] = record;
}

}  // namespace vlx
