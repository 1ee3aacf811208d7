// moldloft-cad: reads CAD files for `moldloft inspect`. It is a program and a package of its own, so that the
// controller's stay small.
#include "firmware_like/cad/cad_import.hpp"
#include "firmware_like/inspection/design_reader.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "hal/base/printable_text.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <exception>

using namespace moldloft::firmware_like;

namespace {

int import_command(const std::string& file, const std::string& out, bool force) {
  const auto design = import_cad(file);
  if (!design) return complain(design.error().what, "moldloft-cad");
  const auto text = json_text(design_json(design->faces, file), 1) + "\n";
  const auto written = write_file(out, text, force ? Existing::replaced : Existing::kept);
  if (!written) return complain(written.error().what, "moldloft-cad");
  std::size_t trimmed = 0;
  for (const auto& face : design->faces) trimmed += face.trims.empty() ? 0 : 1;
  const std::string line = fmt::format(
      "{}: {} {}, {} trimmed, {} made cubic within {:g} mm; the file's unit is {}, design.json is in mm\n",
      moldloft::hal::printable(out), design->faces.size(), design->faces.size() == 1 ? "face" : "faces",
      trimmed, design->approximated, approximated_mm,
      design->unit.empty() ? "not named" : moldloft::hal::printable(design->unit));
  is_standard_output(out) ? say(line) : show(line);
  return exit_done;
}

int run_command_line(int argc, char** argv) {
  CLI::App app{"Reads designs of plates from CAD files, for moldloft inspect", "moldloft-cad"};
  app.set_version_flag("--version", "moldloft-cad " + version_text(), "version, commit and compiler");
  app.require_subcommand(1);
  auto* import = app.add_subcommand("import", "the B-spline faces of a STEP or IGES file as design.json");
  std::string file, out;
  bool force = false;
  import->add_option("file", file, "STEP (.step, .stp) or IGES (.iges, .igs)")->required();
  import->add_option("--out", out, "the design.json to write")->required();
  import->add_flag("--force", force, "write over a file that says something else");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0)
      return show(e.get_name() == "CallForHelp" ? app.help() : app.version() + "\n"), exit_done;
    return complain(fmt::format("{}; moldloft-cad --help explains", e.what()), "moldloft-cad");
  }
  return import_command(file, out, force);
}

}  // namespace

int main(int argc, char** argv) {
  open_console();
  try {
    return end_of_output(run_command_line(argc, argv), "moldloft-cad");
  } catch (const std::exception& e) {
    return complain(fmt::format("a defect, please report it: {}", e.what()), "moldloft-cad");
  }
}
