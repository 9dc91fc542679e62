// SPDX-License-Identifier: Apache-2.0
// What others load at run time; here it is there for the parts beside it.
extern "C" int plugin() { return 0; }
