/// Functions whose loops take a fifth less time with AVX2, which most PCs have and distributions do not compile for.
#pragma once

/// Compiles a function twice; the machine's own variant is chosen when the module is loaded. Both give the same bits:
/// neither contracts a product and a sum.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GLASS_NAV_VECTORIZED __attribute__((target_clones("avx2", "default")))
#else
#define GLASS_NAV_VECTORIZED
#endif
