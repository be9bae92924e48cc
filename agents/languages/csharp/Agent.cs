using System;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Text.RegularExpressions;

/// <summary>Holds the pose in which an episode starts. It needs the standard library only.</summary>
public static class Agent
{
    public static int Main()
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        TextReader questions = new StreamReader(Console.OpenStandardInput());
        TextWriter answers = new StreamWriter(Console.OpenStandardOutput()) { AutoFlush = true, NewLine = "\n" };
        // Whatever a library prints goes to the log: standard output is for answers.
        Console.SetOut(Console.Error);
        Console.WriteLine("hold in C# on {0}", Environment.OSVersion);

        int[] joints = null;
        string[] pose = null;
        for (string line = questions.ReadLine(); line != null; line = questions.ReadLine())
        {
            switch (Word(line, "\"type\"\\s*:\\s*\"(\\w+)\""))
            {
                case "hello":
                    joints = Numbers(line, "joint_pos_ids").Select(int.Parse).ToArray();
                    answers.WriteLine("{\"type\":\"ready\",\"protocol\":1,\"interpolation\":3}");
                    break;
                case "reset":
                    pose = null;
                    answers.WriteLine("{\"type\":\"ready\",\"episode\":" + Number(line, "episode") + "}");
                    break;
                case "step":
                    if (pose == null)
                    {
                        string[] observation = Numbers(line, "obs");
                        pose = joints.Select(index => observation[index]).ToArray();
                    }
                    answers.WriteLine(
                        "{\"type\":\"act\",\"step\":" + Number(line, "step") + ",\"action\":[["
                        + string.Join(",", pose) + "],[0,0,0,0,0,0,0]]}");
                    break;
                case "bye":
                    return 0;
            }
        }
        return 0;
    }

    private static string Word(string line, string pattern)
    {
        Match found = Regex.Match(line, pattern);
        if (!found.Success)
        {
            throw new FormatException("expected " + pattern + " in " + line);
        }
        return found.Groups[1].Value;
    }

    private static string Number(string line, string key)
    {
        return Word(line, "\"" + key + "\"\\s*:\\s*(\\d+)");
    }

    private static string[] Numbers(string line, string key)
    {
        return Word(line, "\"" + key + "\"\\s*:\\s*\\[([^\\]]*)\\]").Split(',').Select(text => text.Trim()).ToArray();
    }
}
