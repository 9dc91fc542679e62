// SPDX-License-Identifier: Apache-2.0
// A block's flops are one list, X(type, name, width in bits, reset value), under the names of the RTL. Declaration, lockstep
// comparison, save/restore and reports are made from that list.
#pragma once

#define TC_DECLARE_FLOP(type, name, width, reset) type name = reset;
#define TC_DECLARE_ARRAY(type, name, count, width) std::array<type, count> name{};
