#include "variolux/base/hash.h"

#define XXH_INLINE_ALL  // nothing to link for those who use variolux::base
#include <xxhash.h>

namespace vlx {

struct ContentHash::State {
    XXH64_state_t xxh;
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) { XXH64_reset(&state_->xxh, 0); }
ContentHash::~ContentHash() = default;
ContentHash::ContentHash(ContentHash&&) noexcept = default;
ContentHash& ContentHash::operator=(ContentHash&&) noexcept = default;

void ContentHash::add(std::span<const std::byte> bytes) {
    XXH64_update(&state_->xxh, bytes.data(), bytes.size());
}

std::uint64_t ContentHash::value() const { return XXH64_digest(&state_->xxh); }

}  // namespace vlx
