#include "firmware_like/report/findings_text.hpp"

#include <doctest/doctest.h>

using namespace moldloft::firmware_like;

namespace {

RunResult measured(Outcome outcome) {
  RunResult r;
  r.outcome = outcome;
  r.measured.emplace();
  r.is_audited = true;
  return r;
}

bool has(const std::string& text, std::string_view what) { return text.find(what) != std::string::npos; }

const Finding spot{.kind = FindingKind::unseen,
                   .gravity = Gravity::warning,
                   .place = Eigen::Vector2d{412.4, 88},
                   .size_mm = 16,
                   .text = "no points <there> & \"here\""};

}  // namespace

TEST_CASE("a result without findings is called complete on the page and adds no line to the table") {
  const RunResult r = measured(Outcome::complete);
  CHECK(has(findings_section(r), "<b>Complete.</b>"));
  CHECK(findings_lines(r).empty());
}

TEST_CASE("a finding stands in the table and on the page, with its place and harmless for both") {
  RunResult r = measured(Outcome::warned);
  r.findings = {spot};
  CHECK(findings_lines(r) == "warning                     no points <there> & \"here\"\n");
  const std::string page = findings_section(r);
  CHECK(has(page, "Measured, with 1 warning."));
  CHECK(has(page, "412, 88"));
  CHECK(has(page, "no points &lt;there&gt; &amp; &quot;here&quot;"));
  r.findings.push_back(spot);
  CHECK(has(findings_section(r), "Measured, with 2 warnings."));
}

TEST_CASE("a result that cannot be trusted says why before anything else") {
  RunResult r = measured(Outcome::held);
  r.message = "the result cannot be trusted: it was moved";
  r.findings = {spot};
  r.findings[0].gravity = Gravity::untrusted;
  const std::string page = findings_section(r);
  CHECK(has(page, "<b>Held:</b> the result cannot be trusted: it was moved."));
  CHECK(has(page, "<td class=\"bad\">untrusted</td>"));
}

TEST_CASE("a result that nobody has audited is not called true") {
  RunResult r = measured(Outcome::complete);
  r.is_audited = false;
  CHECK_FALSE(has(findings_section(r), "Complete."));
  CHECK(has(findings_section(r), "moldloft fit"));
  CHECK(has(findings_lines(r), "audit                       none"));
  r.measured.reset();
  CHECK(findings_section(r).empty());
  CHECK(findings_lines(r).empty());
}
