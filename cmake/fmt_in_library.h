// SPDX-License-Identifier: Apache-2.0
// Leaves the formatting of texts to the library, which has this function. Version 9 does not declare it, so
// each unit that logs would compile it again, in three seconds. Every target on fmt includes this file.
#pragma once

#ifdef __cplusplus
#include <fmt/core.h>

#if FMT_VERSION / 10000 == 9 && !defined(__clang__)
#include <fmt/format.h>

extern template void fmt::detail::vformat_to<char>(fmt::detail::buffer<char>&, fmt::basic_string_view<char>,
                                                   fmt::basic_format_args<fmt::buffer_context<char>>,
                                                   fmt::detail::locale_ref);
#endif
#endif
