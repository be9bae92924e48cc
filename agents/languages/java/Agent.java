import java.io.BufferedReader;
import java.io.FileDescriptor;
import java.io.FileOutputStream;
import java.io.InputStreamReader;
import java.io.PrintStream;
import java.nio.charset.StandardCharsets;
import java.util.regex.Matcher;
import java.util.regex.Pattern;

/** Holds the pose in which an episode starts. It needs the standard library only. */
public final class Agent {
    private static final Pattern TYPE = Pattern.compile("\"type\"\\s*:\\s*\"(\\w+)\"");

    private final PrintStream answers;
    private int[] joints;
    private double[] pose;

    private Agent(PrintStream answers) {
        this.answers = answers;
    }

    public static void main(String[] arguments) throws Exception {
        PrintStream answers =
            new PrintStream(new FileOutputStream(FileDescriptor.out), true, StandardCharsets.UTF_8);
        // Whatever a library prints goes to the log: standard output is for answers.
        System.setOut(System.err);
        System.out.println("heap: at most " + Runtime.getRuntime().maxMemory() + " bytes");
        Agent agent = new Agent(answers);
        BufferedReader questions =
            new BufferedReader(new InputStreamReader(System.in, StandardCharsets.UTF_8));
        for (String line = questions.readLine(); line != null; line = questions.readLine()) {
            Matcher type = TYPE.matcher(line);
            if (!type.find()) {
                throw new IllegalArgumentException("a message without a type: " + line);
            }
            if (!agent.answer(type.group(1), line)) {
                return;
            }
        }
    }

    /** Answers a message; false after the last one. */
    private boolean answer(String type, String line) {
        switch (type) {
            case "hello":
                double[] ids = numbers(line, "joint_pos_ids");
                joints = new int[ids.length];
                for (int i = 0; i < ids.length; i++) {
                    joints[i] = (int) ids[i];
                }
                answers.println("{\"type\":\"ready\",\"protocol\":1,\"interpolation\":3}");
                return true;
            case "reset":
                pose = null;
                answers.println("{\"type\":\"ready\",\"episode\":" + number(line, "episode") + "}");
                return true;
            case "step":
                if (pose == null) {
                    double[] observation = numbers(line, "obs");
                    pose = new double[joints.length];
                    for (int i = 0; i < joints.length; i++) {
                        pose[i] = observation[joints[i]];
                    }
                }
                StringBuilder action = new StringBuilder("{\"type\":\"act\",\"step\":");
                action.append(number(line, "step")).append(",\"action\":[[");
                for (int i = 0; i < pose.length; i++) {
                    action.append(i == 0 ? "" : ",").append(pose[i]);
                }
                action.append("],[0,0,0,0,0,0,0]]}");
                answers.println(action);
                return true;
            default:
                return !type.equals("bye");
        }
    }

    private static String number(String line, String key) {
        Matcher found = Pattern.compile("\"" + key + "\"\\s*:\\s*(\\d+)").matcher(line);
        if (!found.find()) {
            throw new IllegalArgumentException("no " + key + " in " + line);
        }
        return found.group(1);
    }

    private static double[] numbers(String line, String key) {
        Matcher found = Pattern.compile("\"" + key + "\"\\s*:\\s*\\[([^\\]]*)\\]").matcher(line);
        if (!found.find()) {
            throw new IllegalArgumentException("no " + key + " in " + line);
        }
        String[] words = found.group(1).split(",");
        double[] values = new double[words.length];
        for (int i = 0; i < words.length; i++) {
            values[i] = Double.parseDouble(words[i]);
        }
        return values;
    }
}
