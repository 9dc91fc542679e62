// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cmodel/chip.hpp"
#include "recording/stream.hpp"
#include "recording/text.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// A folder of its own for each test.
class Command : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("meltstage_" + std::string(info->name()) + "." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  fs::path out() const { return folder_ / "out"; }
  Ran print(const fs::path& job, const std::string& more = "--rtl none") const {
    return run_command("print " + job.string() + " --out " + out().string() + " " + more);
  }
  // Wrong input: one line, status 2, nothing left behind.
  void expect_refused(const Ran& ran, const std::string& part) const {
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, StartsWith("meltstage: "));
    EXPECT_THAT(ran.output, HasSubstr(part));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    for (const auto& entry : fs::directory_iterator(folder_))
      EXPECT_THAT(entry.path().filename().string(), ::testing::Not(StartsWith("out")));
  }

  fs::path folder_;
};

constexpr const char* kBumps = "x_mm,y_mm\n10,10\n12,10\n10,12\n12,12\n";
// A small job that is at temperature soon.
constexpr const char* kJob = R"([coordinates]
file = "bumps.csv"
[head]
plant = "E3D-like"
[temperature]
setpoint_degc = 28.0
window_degc = 1.0
dwell_s = 0.3
[print]
droplet_j = 0.02
settle_ms = 5
)";

TEST_F(Command, PrintsAJobAndItsFolder) {
  write("bumps.csv", kBumps);
  const Ran ran = print(write("job.toml", kJob), "--rtl chosen --vcd");
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("4 of 4 bumps printed, heater off"));
  for (const char* name : {"report.html", "summary.json", "pins.mvec", "pins.vcd"})
    EXPECT_TRUE(fs::exists(out() / name)) << name;
  const auto summary = nlohmann::json::parse(std::ifstream(out() / "summary.json"));
  std::uint64_t clocks = 0;
  for (const auto& window : summary.at("lockstep")) clocks += window.at("clocks").get<std::uint64_t>();
  EXPECT_GT(clocks, 1'000'000u);
}

// The recorded pins, played into a fresh model, give the recorded outputs.
TEST_F(Command, RecordedPinsReplayOnTheModel) {
  write("bumps.csv", kBumps);
  ASSERT_EQ(print(write("job.toml", kJob)).status, 0);
  const recording::Stream stream = recording::read_text(out() / "pins.mvec");
  const auto pin = [&](const char* name) { return *recording::find_pin(stream.header(), name); };
  const std::uint32_t rst = pin("rst_ni"), rx = pin("uart_rx_i"), strap = pin("addr_strap_i"),
                      miso = pin("spi_miso_i"), fb = pin("heater_fb_i"), inhibit = pin("inhibit_i"),
                      drop = pin("drop_i"), tx = pin("uart_tx_o"), heater = pin("heater_o"),
                      sclk = pin("spi_sclk_o"), at_temp = pin("at_temp_o"), trigger = pin("drop_trigger");
  chip::Chip chip;
  chip::Outputs standing = chip.outputs({.rst_n = false});
  recording::Cursor cursor(stream);
  std::uint64_t mismatches = 0, heated = 0, droplets = 0;
  bool triggered = false;
  do {
    const chip::Inputs in{.rst_n = cursor.value(rst) != 0,
                          .uart_rx = cursor.value(rx) != 0,
                          .addr_strap = static_cast<std::uint8_t>(cursor.value(strap)),
                          .spi_miso = cursor.value(miso) != 0,
                          .heater_fb = cursor.value(fb) != 0,
                          .inhibit = cursor.value(inhibit) != 0,
                          .drop = cursor.value(drop) != 0};
    mismatches +=
        standing.uart_tx != (cursor.value(tx) != 0) || standing.heater != (cursor.value(heater) != 0) ||
        standing.spi_sclk != (cursor.value(sclk) != 0) || standing.at_temp != (cursor.value(at_temp) != 0);
    heated += standing.heater;
    if (cursor.value(trigger) != 0 && !triggered) {
      ++droplets;
      EXPECT_TRUE(standing.at_temp) << "droplet while not at temperature, cycle " << cursor.cycle();
    }
    triggered = cursor.value(trigger) != 0;
    standing = chip.step(in);
  } while (cursor.step());
  EXPECT_EQ(mismatches, 0u);
  EXPECT_GT(heated, 0u);
  EXPECT_EQ(droplets, 4u);
}

TEST_F(Command, ReadsKicadFootprintsAndSpreadsheets) {
  const std::string source = MELTSTAGE_SOURCE_DIR;
  for (const char* file : {"bga.kicad_mod", "bumps_8x8.xls"}) {
    fs::copy_file(source + "/examples/" + file, folder_ / file);
    std::string job = kJob;
    job.replace(job.find("bumps.csv\""), 10, std::string(file) + "\"\norigin_x_mm = 50\norigin_y_mm = 50");
    const Ran ran = print(write("job.toml", job));
    EXPECT_EQ(ran.status, 0) << file << ": " << ran.output;
  }
}

TEST_F(Command, AlignsABoardByItsMarksOrSaysWhyNot) {
  write("bumps.csv", "x_mm,y_mm\n100,100\n102,100\n");
  write("marks.csv", "x_mm,y_mm\n90,90\n118,90\n118,114\n");
  const auto with = [&](const std::string& fields) {
    return print(write("job.toml", std::string(kJob) + "[alignment]\nmarks = \"marks.csv\"\n" + fields));
  };
  expect_refused(with("missing_mark = 2\n"), "board mark 2: found 0 marks within 2 mm of (118.000, 90.000)");
  expect_refused(with("upside_down = true\n"), "is it dirty, or the board upside down");
  expect_refused(with("board_x_um = 5000\n"), "board mark 1: found 0 marks");
  expect_refused(with("board_turn_deg = 1.5\n"), "stage pose out of reach: branch 2");
  const Ran short_of_it = with("board_x_um = 500\ntolerance_um = 0.1\n");
  EXPECT_EQ(short_of_it.status, 1);
  EXPECT_THAT(short_of_it.output, HasSubstr("wanted 0.1 um; nothing printed, nothing written"));
  EXPECT_FALSE(fs::exists(out()));

  const Ran ran = with("board_x_um = 500\nboard_turn_deg = -0.3\n");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("um after 1 move, wanted 5.0 um"));
  EXPECT_THAT(ran.output, ::testing::Not(HasSubstr("note:")));
  const auto summary = nlohmann::json::parse(std::ifstream(out() / "summary.json"));
  const auto figures = summary.at("key_figures");
  const auto off = std::find_if(figures.begin(), figures.end(), [](const auto& figure) {
    return figure.at("what") == "Board marks off, aligned";
  });
  ASSERT_NE(off, figures.end());
  EXPECT_LT(off->at("value").template get<double>(), 5.0);

  write("marks.csv", "x_mm,y_mm\n90,90\n118,114\n");
  EXPECT_THAT(with("").output, HasSubstr("note: these marks look the same with the board turned over"));
}

TEST_F(Command, EmergencyStopEndsTheJobWithStatusOne) {
  write("bumps.csv", kBumps);
  const Ran ran =
      print(write("job.toml", std::string(kJob) + "[[event]]\nat_s = 1.0\nwhat = \"emergency-stop\"\n"));
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("Inhibit"));
  EXPECT_TRUE(fs::exists(out() / "report.html"));
}

TEST_F(Command, SensorFaultEndsTheJobWithStatusOne) {
  write("bumps.csv", kBumps);
  const Ran ran =
      print(write("job.toml", std::string(kJob) + "[[event]]\nat_s = 1.0\nwhat = \"sensor-open\"\n"));
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("SensorFault"));
}

TEST_F(Command, LostHostEndsTheJobByTheWatchdog) {
  write("bumps.csv", kBumps);
  const Ran ran = print(
      write("job.toml",
            std::string(kJob) + "[registers]\nHOST_WD = 0.5\n[[event]]\nat_s = 1.0\nwhat = \"host-lost\"\n"));
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("HostWatchdog"));
}

TEST_F(Command, WrongJobFilesAreRefusedInOneLine) {
  write("bumps.csv", kBumps);
  expect_refused(print(folder_ / "absent.toml"), "absent.toml: no such file");
  expect_refused(print(folder_), "found a folder, expected a job file");
  expect_refused(print(write("empty.toml", "")), "is empty");
  expect_refused(print(write("broken.toml", "[job\nname = 1")), "broken.toml:1:");
  expect_refused(print(write("job.toml", "[coordinates]\n")), "coordinates.file: found nothing");
  expect_refused(print(write("job.toml", std::string(kJob) + "[jobb]\n")), ":1: jobb: found an unknown key");
  expect_refused(print(write("job.toml", std::string(kJob) + "[stage]\nspeed = 1\n")),
                 "stage.speed: found an unknown key");
  expect_refused(print(write("job.toml", std::string(kJob) + "[stage]\nspeed_mm_s = \"fast\"\n")),
                 "found \"fast\", expected a number");
  expect_refused(print(write("job.toml", std::string(kJob) + "[stage]\nspeed_mm_s = -1\n")),
                 "stage.speed_mm_s: found -1, expected 0.1 to 400");
  expect_refused(print(write("job.toml", std::string(kJob) + "[registers]\nKP = nan\n")),
                 "registers.KP: found nan");
  expect_refused(print(write("job.toml", std::string(kJob) + "[registers]\nBAUD = 9600\n")),
                 "registers.BAUD");
  expect_refused(print(write("job.toml", std::string(kJob) + "[rtl]\nwindows = \"some\"\n")),
                 "expected one of: chosen, full, none");
  expect_refused(print(write("job.toml", std::string(kJob) + "[[event]]\nat_s = 1\nwhat = \"flood\"\n")),
                 "expected one of: emergency-stop");
}

TEST_F(Command, OnTheFlyEveryBumpIsPrinted) {
  // The last row has one bump, outside the row before: its plan ends some micrometres behind the trigger.
  write("bumps.csv", "x_mm,y_mm\n50,50\n52,50\n54,51\n");
  const Ran ran =
      print(write("job.toml",
                  "[coordinates]\nfile = \"bumps.csv\"\n[print]\nmode = \"fly-by\"\n"
                  "[head]\nplant = \"E3D-like\"\n[temperature]\nsetpoint_degc = 60\nperiod_ms = 200\n"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("3 of 3 bumps printed"));
}

TEST_F(Command, NotesTellWhatTheJobWontDo) {
  // Three columns of numbers that no row names, bumps that share no rows, an event behind the end.
  write("bumps.csv", "10,10,1\n30,12,1\n50,14,1\n");
  const Ran ran = print(write(
      "job.toml", std::string(kJob) + "mode = \"fly-by\"\n[[event]]\nat_s = 500\nwhat = \"stage-jam\"\n"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output,
              HasSubstr("bumps.csv: no row names the columns: x is column 1 and y column 2 of 3\n"));
  EXPECT_THAT(ran.output, HasSubstr("note: on the fly the rows take "));
  EXPECT_THAT(ran.output, HasSubstr("mode = \"stop\" is sooner\n"));
  EXPECT_THAT(ran.output, HasSubstr("note: the [[event]] at 500 s never came: the job was over at "));
  const auto summary = nlohmann::json::parse(std::ifstream(out() / "summary.json"));
  double planned_s = 0.0, printed_s = 0.0;
  for (const auto& figure : summary.at("key_figures")) {
    if (figure.at("what") == "Rows on the fly, planned") planned_s = figure.at("value");
    if (figure.at("what") == "Print time") printed_s = figure.at("value");
  }
  EXPECT_GT(planned_s, 0.5);
  EXPECT_NEAR(planned_s, printed_s, 0.05);
}

TEST_F(Command, HostileJobFilesAreRefusedInOneLine) {
  std::string dots = "a";
  for (int i = 0; i < 300'000; ++i) dots += ".a";
  expect_refused(print(write("dots.toml", dots + " = 1\n")), "dots.toml:1:130: found a key of more than 64");
  expect_refused(print(write("deep.toml", "a = " + std::string(100'000, '['))), "deep.toml:1:69: found more");
  expect_refused(print(write("word.toml", "[stage]\nquiet = tru\n")), "word.toml:2:");
  // codes that would turn the terminal red, clear it or retitle it
  const Ran name = print(write("job.toml", "[job]\nname = \"\\u001b[31mred\"\n" + std::string(kJob)));
  expect_refused(name, "job.toml:2:8: job.name: found \"\\x1B[31mred\", expected a text without control");
  const Ran key = print(write("job.toml", std::string(kJob) + "[\"\\u001b]0;title\\u0007\"]\n"));
  expect_refused(key, "an unknown key");
  const Ran file = print(write("job.toml", "[coordinates]\nfile = \"\\u009b31m.csv\"\n"));
  expect_refused(file, "coordinates.file: found \"\\xC2\\x9B31m.csv\"");
  const Ran path = print(folder_ / "'\x1b[2Jabsent.toml'");
  expect_refused(path, "\\x1B[2Jabsent.toml: no such file");
  for (const Ran& ran : {name, key, file, path}) EXPECT_THAT(ran.output, Not(HasSubstr("\x1b")));
}

TEST_F(Command, AFolderThatHoldsTheJobIsNotReplaced) {
  fs::create_directory(out());
  write("out/summary.json", "{}");
  write("out/bumps.csv", kBumps);
  const Ran ran = print(write("out/job.toml", kJob));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("out/job.toml lies in it; choose another folder"));
  EXPECT_TRUE(fs::exists(out() / "bumps.csv"));
}

TEST_F(Command, WrongCoordinateFilesAreRefusedInOneLine) {
  const fs::path job = write("job.toml", kJob);
  expect_refused(print(job), "bumps.csv");  // missing
  const auto with = [&](const std::string& text) {
    write("bumps.csv", text);
    return print(job);
  };
  expect_refused(with(""), "empty");
  expect_refused(with("x_mm,y_mm\n"), "no ");
  expect_refused(with("x_mm,y_mm\n1,2\n3,four\n"), "four");
  expect_refused(with("x_mm,y_mm\n1,2\n3,nan\n"), "nan");
  expect_refused(with("x_mm,y_mm\n1,2\n5,5\n1,2\n"), "row 4");
  expect_refused(with("x_mm,y_mm\n1,2\n3,201\n"), "201");
  expect_refused(with("x_mm,y_mm\n1,2\n3\n"), "row 3");
  expect_refused(with("\x89PNG\r\n\x1a\n"), "bumps.csv");
}

TEST_F(Command, InterruptedPrintLeavesNothing) {
  write("bumps.csv", kBumps);
  write("job.toml", kJob);
  for (const std::string signal : {"INT", "TERM", "HUP"}) {
    // With the RTL beside it, so that it takes long enough.
    const Ran ran = run_command("print " + (folder_ / "job.toml").string() + " --out " + out().string() +
                                " 2>&1 & sleep 1; kill -" + signal + " $!; wait $!; echo status $?");
    EXPECT_THAT(ran.output, HasSubstr("interrupted; nothing written")) << signal;
    EXPECT_THAT(ran.output, HasSubstr("status 1")) << signal;
    for (const auto& entry : fs::directory_iterator(folder_))
      EXPECT_THAT(entry.path().filename().string(), ::testing::Not(StartsWith("out"))) << signal;
  }
}

TEST_F(Command, ForeignFolderIsNotReplaced) {
  write("bumps.csv", kBumps);
  fs::create_directories(folder_ / "mine");
  std::ofstream(folder_ / "mine" / "thesis.txt") << "x";
  const Ran ran = run_command("print " + write("job.toml", kJob).string() + " --rtl none --out " +
                              (folder_ / "mine").string());
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("mine/thesis.txt: was not written by `meltstage print`"));
  EXPECT_TRUE(fs::exists(folder_ / "mine" / "thesis.txt"));
}

TEST_F(Command, OptionForTheFullJobIsRefusedWithout) {
  write("bumps.csv", kBumps);
  const Ran ran = print(write("job.toml", kJob), "--slurm");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("--slurm: is for the full job in RTL"));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Command, AnUnknownCommandIsNamedBesideThoseThatThereAre) {
  EXPECT_THAT(run_command("prnit").output,
              AllOf(HasSubstr("found \"prnit\", expected one of: init, coordinates, print, "),
                    Not(HasSubstr("required"))));
  EXPECT_THAT(run_command("chip raed").output,
              AllOf(HasSubstr("meltstage chip: found \"raed\""), HasSubstr(" read, ")));
  EXPECT_THAT(run_command("dft").output, HasSubstr("meltstage dft: no command given, expected one of: "));
  EXPECT_THAT(run_command("bench --nonsense").output, HasSubstr("meltstage bench: "));
}

TEST_F(Command, WrongUseHasStatusTwo) {
  EXPECT_EQ(run_command("").status, 2);
  EXPECT_EQ(run_command("prnit").status, 2);
  EXPECT_EQ(run_command("print").status, 2);
  EXPECT_EQ(run_command("bench nonsense").status, 2);
  EXPECT_EQ(run_command("bench --nonsense").status, 2);
  EXPECT_EQ(run_command("--help").status, 0);
  EXPECT_EQ(run_command("bench --list").status, 0);
}

TEST_F(Command, BenchLockstepMeetsItsRowsAndSpeaksJson) {
  const Ran ran = run_command("bench lockstep --quick --json");
  const auto report = nlohmann::json::parse(ran.output);
  EXPECT_EQ(report.at("rows").size(), 7u);
  for (const auto& row : report.at("rows")) EXPECT_GT(row.at("value").get<double>(), 0.0) << row.at("what");
}

}  // namespace
}  // namespace meltstage
