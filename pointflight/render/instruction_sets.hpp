// What the processor can do at once.
#pragma once

#include <string>
#include <vector>

namespace pointflight {

/// Instruction sets of this processor that this build has kernels for, the best first ("AVX2").
/// Results do not depend on which is used.
std::vector<std::string> instruction_sets();

/// From now on kernels of this one are used, in all threads; "": the best. For tests. Throws
/// InputError for one that is not in `instruction_sets`.
void use_instruction_set(const std::string& name);

}  // namespace pointflight
