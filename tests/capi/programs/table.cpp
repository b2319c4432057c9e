// Compares each function of the table with the linked one. The names are in functions.inc.
#include <cstddef>
#include <cstdio>
#include <type_traits>

#include "sabaki.h"

int main() {
    sabaki_api api = {};
    if (sabaki_get_api(nullptr) != SABAKI_ERROR) {
        return 1;
    }
    api.size = offsetof(sabaki_api, set_log);
    if (sabaki_get_api(&api) != SABAKI_OK || api.last_error != &sabaki_last_error || api.set_log) {
        return 2;
    }
    struct {
        sabaki_api api;
        void *further;
    } newer = {};
    newer.api.size = sizeof newer;
    if (sabaki_get_api(&newer.api) != SABAKI_OK || newer.api.size != sizeof newer.api || newer.further) {
        return 3;
    }
    api.size = sizeof api;
    if (sabaki_get_api(&api) != SABAKI_OK || api.version() != SABAKI_VERSION_NUMBER) {
        return 4;
    }
    unsigned count = 0;
#define HAS(name)                                                                                \
    static_assert(std::is_same<decltype(api.name), decltype(&sabaki_##name)>::value, #name);    \
    if (api.name != &sabaki_##name) {                                                            \
        std::puts(#name);                                                                        \
        return 5;                                                                                \
    }                                                                                            \
    count++;
#include "functions.inc"
    std::printf("%u functions\n", count);
    return offsetof(sabaki_api, version) + count * sizeof(void *) == sizeof api ? 0 : 6;
}
