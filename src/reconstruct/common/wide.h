#pragma once

/// Marks a function with long loops over floats: compiled for AVX2 as well, chosen at run time. Files that
/// use it are compiled without contraction to fused operations, so that both give the same bits. Not under
/// sanitizers, whose instrumented resolvers run before their runtime is ready.
#if defined(__x86_64__) && !defined(VARIOLUX_SANITIZED)
#define VLX_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define VLX_WIDE
#endif

namespace vlx {

/// exp(-d) within 0.02 for d >= 0, exactly 0 from 8 on: (1 - d/8)^8. A weight needs no more, and this is four
/// products.
inline float nearExp(float d) {
    const float base = 1 - 0.125f * d;
    const float positive = base > 0 ? base : 0;
    const float square = positive * positive;
    const float fourth = square * square;
    return fourth * fourth;
}

}  // namespace vlx
