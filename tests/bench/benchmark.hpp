// A benchmark: one run in which ours, the floor (what the machine cannot do without) and the peers do the same
// work one after the other, so that their ratios mean something on a noisy machine.
//
// A benchmark returns one JSON object, whose keys are its contract (tests/README.md), and prints its table for
// people unless `quiet`. A peer that is not installed is null in the object and a word in the table.
#pragma once

#include <nlohmann/json.hpp>

#include <string_view>

namespace moldloft::bench {

using Json = nlohmann::ordered_json;

struct Options {
  bool quiet = false;  // --json: the table is not printed
  bool quick = false;  // --quick: fewer repeats and smaller sizes, to see that it runs
};

struct Benchmark {
  std::string_view name, what;
  Json (*run)(const Options&);
};

}  // namespace moldloft::bench
