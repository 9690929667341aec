// Compiled for the least processor of x86-64, and run before initialisers of all other units.

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "processor/needed.h"

#ifdef __x86_64__

namespace limber::processor {
namespace {

void say(const char* text) {
  // Nobody is left to tell where this fails.
  if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
}

/// By name, since the compiler's function takes literals alone.
class Missing {
 public:
  void look(unsigned set, bool is_there, const char* name) {
    if ((needed & set) == 0 || is_there) return;
    if (is_any_) {
      say(", ");
    } else {
      say(program_invocation_short_name);
      say(": this processor lacks instructions that this build needs: ");
    }
    say(name);
    is_any_ = true;
  }
  [[nodiscard]] bool is_any() const { return is_any_; }

 private:
  bool is_any_ = false;
};

}  // namespace

/// 101 is the first priority that programs may have: static objects come behind it, and so does
/// all code that was compiled for the sets in question.
__attribute__((constructor(101))) static void demand_processor() {
  __builtin_cpu_init();
  Missing missing;
  missing.look(kSse3, __builtin_cpu_supports("sse3") != 0, "SSE3");
  missing.look(kSsse3, __builtin_cpu_supports("ssse3") != 0, "SSSE3");
  missing.look(kSse41, __builtin_cpu_supports("sse4.1") != 0, "SSE4.1");
  missing.look(kSse42, __builtin_cpu_supports("sse4.2") != 0, "SSE4.2");
  missing.look(kPopcnt, __builtin_cpu_supports("popcnt") != 0, "POPCNT");
  missing.look(kAvx, __builtin_cpu_supports("avx") != 0, "AVX");
  missing.look(kAvx2, __builtin_cpu_supports("avx2") != 0, "AVX2");
  missing.look(kBmi, __builtin_cpu_supports("bmi") != 0, "BMI1");
  missing.look(kBmi2, __builtin_cpu_supports("bmi2") != 0, "BMI2");
  missing.look(kFma, __builtin_cpu_supports("fma") != 0, "FMA");
  missing.look(kAvx512f, __builtin_cpu_supports("avx512f") != 0, "AVX512F");
  missing.look(kAvx512bw, __builtin_cpu_supports("avx512bw") != 0, "AVX512BW");
  missing.look(kAvx512cd, __builtin_cpu_supports("avx512cd") != 0, "AVX512CD");
  missing.look(kAvx512dq, __builtin_cpu_supports("avx512dq") != 0, "AVX512DQ");
  missing.look(kAvx512vl, __builtin_cpu_supports("avx512vl") != 0, "AVX512VL");
  if (!missing.is_any()) return;
  say(".\nBuild it for this one: cmake --preset release -DLIMBER_ARCH=x86-64\n");
  ::_exit(EXIT_FAILURE);
}

}  // namespace limber::processor

#endif
