#include "sweep/sweep_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "variolux/base/error.h"

namespace vlx {

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
