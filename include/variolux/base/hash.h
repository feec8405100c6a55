#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace vlx {

/// A bijection of 64-bit words in which every output bit depends on every input bit (the finaliser of
/// splitmix64: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
constexpr std::uint64_t mixBits(std::uint64_t v) {
    v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
    v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
    return v ^ (v >> 31);
}

/// Hash of a sequence of integers, order included: the seed of everything random that belongs to
/// (seed, pixel, dimension, ...). Not for hash tables of untrusted keys. Not XXH64, as contents are hashed
/// with: all samples that were ever traced follow from these seeds.
constexpr std::uint64_t hashOf(std::integral auto... values) {
    std::uint64_t h = 0;
    ((h = mixBits((h + 0x9e3779b97f4a7c15u) ^ static_cast<std::uint64_t>(values))), ...);
    return h;
}

/// XXH64 of bytes that come in pieces, however they are cut: tells contents of files and images apart.
class ContentHash {
  public:
    ContentHash();
    ~ContentHash();
    ContentHash(ContentHash&&) noexcept;
    ContentHash& operator=(ContentHash&&) noexcept;

    void add(std::span<const std::byte> bytes);
    /// Of all that was added so far.
    std::uint64_t value() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace vlx
