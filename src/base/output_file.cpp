#include "variolux/base/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "variolux/base/error.h"

namespace vlx {

namespace fs = std::filesystem;

namespace {

// Names that a signal handler can read: neither allocated nor locked.
struct Slot {
    enum State : int { Free, Changing, Live };
    std::atomic<int> state{Free};
    char path[PATH_MAX] = {};
};
std::array<Slot, 64> slots;
static_assert(std::atomic<int>::is_always_lock_free);
// The process is about to end: nothing is begun any more.
std::atomic<bool> ending{false};

// Number of the slot that names this file from now on; -1 when all are taken or the name is too long.
int enterSlot(const std::string& path) {
    if (path.size() >= PATH_MAX) return -1;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        int free = Slot::Free;
        if (!slots[i].state.compare_exchange_strong(free, Slot::Changing)) continue;
        std::memcpy(slots[i].path, path.c_str(), path.size() + 1);
        slots[i].state = Slot::Live;
        return static_cast<int>(i);
    }
    return -1;
}

void leaveSlot(int slot) {
    if (slot >= 0) slots[static_cast<std::size_t>(slot)].state = Slot::Free;
}

}  // namespace

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
    slot_ = enterSlot(fs::absolute(temporary_, ignored).string());
    const int descriptor = ::open(temporary_.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0666);
    const int code = errno;
    if (descriptor >= 0) ::close(descriptor);
    if (descriptor >= 0 && !ending) return;
    if (descriptor >= 0) ::unlink(temporary_.c_str());
    leaveSlot(slot_);
    throw Error(path_, std::string("expected to create this file: ") +
                           (descriptor < 0 ? std::strerror(code) : "the program is ending"));
}

OutputFile::~OutputFile() {
    if (!committed_) ::unlink(temporary_.c_str());
    leaveSlot(slot_);
}

void OutputFile::write(std::string_view bytes) const {
    std::ofstream stream(temporary_, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw Error(path_, "writing to disk failed");
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

void writeFile(const std::string& path, std::string_view bytes) {
    OutputFile file(path);
    file.write(bytes);
    file.commit();
}

void removeUnfinishedFiles() noexcept {
    ending = true;
    for (const Slot& slot : slots)
        if (slot.state == Slot::Live) ::unlink(slot.path);
}

}  // namespace vlx
