// SPDX-License-Identifier: Apache-2.0
// Debian's C++ library for WebAssembly has no exceptions. The bench throws where its caller is wrong; in the
// page that ends the run with a trap, which the script tells.
#include <cstddef>

extern "C" {

void* __cxa_allocate_exception(std::size_t) noexcept { __builtin_trap(); }
void __cxa_free_exception(void*) noexcept {}
void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }
}
