// The list of all ways in which these tests break a shell or its source, with the verifier's verdicts.
#pragma once

#include <relief/verify/verify.h>

#include <string>
#include <string_view>

namespace relief::verify {

/// Notes a way of breaking something and what the verifier says of it; gives the certificate back. With
/// RELIEF_VERIFIER_REPORT=FILE in the environment the list is written there at the end of the program as a table, which
/// must then stand in docs/evidence/verifier.md as well.
Certificate reported(std::string_view way, Certificate certificate);

}  // namespace relief::verify
