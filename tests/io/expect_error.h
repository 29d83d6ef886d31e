#pragma once

#include <gtest/gtest.h>

#include <string>

#include "curvesup/core/error.h"

namespace curvesup {

// Runs `action`, which must throw an Error of this kind whose text holds all of the given words.
template <class Action>
void expect_error(ErrorKind kind, std::initializer_list<std::string> words, const Action& action) {
  try {
    action();
    ADD_FAILURE() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string& word : words) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << "no '" << word << "' in: " << error.what();
    }
  }
}

}  // namespace curvesup
