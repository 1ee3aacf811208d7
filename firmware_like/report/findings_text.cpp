#include "firmware_like/report/findings_text.hpp"

#include "firmware_like/process/markup.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

constexpr std::string_view not_audited =
    "none: an earlier version has measured this run; `moldloft fit RUN --out DIR` audits it";

std::string verdict_of(const RunResult& r) {
  if (!r.is_audited && r.outcome == Outcome::complete) return "";
  switch (r.outcome) {
    case Outcome::complete:
      return "<div class=\"verdict yes\"><b>Complete.</b> Every edge point lies on the outline, every shot "
             "agrees with "
             "the others, every part of the plate was seen.</div>\n";
    case Outcome::warned:
      return fmt::format(
          "<div class=\"verdict no\"><b>Measured, with {} warning{}.</b> The result holds but for what "
          "is named here.</div>\n",
          r.findings.size(), r.findings.size() == 1 ? "" : "s");
    default:
      return fmt::format("<div class=\"verdict no\"><b>{}:</b> {}.</div>\n",
                         r.outcome == Outcome::held ? "Held" : escaped(to_string(r.outcome)),
                         escaped(r.message));
  }
}

}  // namespace

std::string findings_lines(const RunResult& r) {
  std::string text;
  if (r.measured && !r.is_audited) text = fmt::format("{:<28}{}\n", "audit", not_audited);
  for (const Finding& f : r.findings)
    text += fmt::format("{:<28}{}\n", to_string(f.gravity), hal::printable(f.text));
  return text;
}

std::string findings_section(const RunResult& r) {
  if (!r.measured) return "";
  std::string html = "<section>\n<h2>Is the result true?</h2>\n" + verdict_of(r);
  if (!r.is_audited) return html + fmt::format("<p>{}</p>\n</section>\n", not_audited);
  if (r.findings.empty()) return html + "</section>\n";
  html +=
      "<div class=\"wide\"><table class=\"words\">\n<thead><tr><th></th><th></th><th>what was "
      "found</th><th>at x, y, "
      "mm</th>"
      "</tr></thead>\n<tbody>\n";
  int number = 0;
  for (const Finding& f : r.findings) {
    const std::string place = f.place ? fmt::format("{:.0f}, {:.0f}", f.place->x(), f.place->y()) : "-";
    html += fmt::format("<tr><td>{}</td><td{}>{}</td><td>{}</td><td>{}</td></tr>\n", ++number,
                        f.gravity == Gravity::untrusted ? " class=\"bad\"" : "", to_string(f.gravity),
                        escaped(f.text), place);
  }
  return html + "</tbody></table></div>\n</section>\n";
}

}  // namespace moldloft::firmware_like
